// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/scene.hpp"

namespace drape::compare {

/// Quads of the outer surfaces of all objects of a scene, for pictures; world frame, metres. A
/// sphere has 24 x 12 quads, each face of a box 4 x 4; rounded edges are drawn sharp, a plane as a
/// square of 300 mm.
[[nodiscard]] std::vector<std::array<Eigen::Vector3d, 4>> obstacle_quads(const Scene& scene);

}  // namespace drape::compare
