// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "core/scene.hpp"
#include "simulate/fabric/fabric.hpp"

namespace drape::simulate {

/// Every file that a drape is made of: scene, print, fabric with its curves, meshes of the objects.
[[nodiscard]] std::vector<std::filesystem::path> files_of(const Scene& scene, const Fabric& fabric);

}  // namespace drape::simulate
