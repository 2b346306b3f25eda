// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "simulate/fabric/laws.hpp"

namespace drape::simulate {

/// A scene drawn at random, and its cloth.
struct DrawnScene {
  Scene scene;
  Print print;
  ClothLaws laws;
};

/// Scene `index` of a sequence that is the same everywhere: by turns a ball, a box of sharp and of
/// round edges, a cylinder, a lobed and an edged mesh of 500 to 5,000 facets, on a table, and cloth
/// that hangs by two near pins and folds on itself. Writes a mesh's file into `folder`.
[[nodiscard]] DrawnScene drawn_scene(int index, const std::filesystem::path& folder);

}  // namespace drape::simulate
