// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/scene.hpp"

namespace drape::compare {

/// Quads of the outsides of all objects of a scene, for pictures; world frame, metres. A sphere is
/// cut into 24 x 12, each face of a box into 4 x 4; rounded edges are drawn sharp.
[[nodiscard]] std::vector<std::array<Eigen::Vector3d, 4>> obstacle_quads(const Scene& scene);

}  // namespace drape::compare
