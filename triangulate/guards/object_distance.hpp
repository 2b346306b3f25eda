// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/scene.hpp"

namespace drape::triangulate {

/// Signed distance (m) from the object's surface, negative inside. Nothing for a mesh.
[[nodiscard]] std::optional<double> distance_to(const Obstacle& object,
                                                const Eigen::Vector3d& point_in_world);

}  // namespace drape::triangulate
