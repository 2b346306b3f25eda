// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/scene.hpp"
#include "simulate/fabric/laws.hpp"

namespace drape::simulate {

/// A random scene and its cloth.
struct DrawnScene {
  Scene scene;
  Print print;
  ClothLaws laws;
};

/// Scene `index` of a fixed sequence, alternating between a ball, a box with sharp and with round
/// edges, a cylinder, a lobed and an edged mesh of 500 to 5,000 facets, on a table, and cloth that
/// hangs from two close pins and folds onto itself. Writes a mesh's file into `folder`.
[[nodiscard]] DrawnScene drawn_scene(int index, const std::filesystem::path& folder);

}  // namespace drape::simulate
