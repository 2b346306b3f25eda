// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// Quads of the outsides of all objects of a scene, for pictures; world frame, metres. A sphere is
/// cut into 24 x 12, each face of a box into 4 x 4; rounded edges are drawn sharp, of a plane a
/// square of 300 mm.
[[nodiscard]] std::vector<std::array<Eigen::Vector3d, 4>> obstacle_quads(const Scene& scene);

/// The same without those that the cloth covers (all corners within 8 mm of it): pictures that sort
/// their pieces by depth cannot tell which of two touching pieces is in front.
[[nodiscard]] std::vector<std::array<Eigen::Vector3d, 4>> uncovered_quads(const Scene& scene,
                                                                          const Sheet& cloth);

}  // namespace drape::compare
