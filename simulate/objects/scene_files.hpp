// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "core/scene.hpp"
#include "simulate/fabric/fabric.hpp"

namespace drape::simulate {

/// All input files of a drape: scene, print, fabric with its curves, meshes of the objects.
[[nodiscard]] std::vector<std::filesystem::path> files_of(const Scene& scene, const Fabric& fabric);

}  // namespace drape::simulate
