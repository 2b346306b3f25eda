// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace drape {

/// z of a x b; twice the signed area of the triangle 0, a, b.
[[nodiscard]] inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Area of a closed polygon, positive if it runs counter-clockwise.
[[nodiscard]] double signed_area(const std::vector<Eigen::Vector2d>& polygon);

/// Skew-symmetric matrix [v]x, with [v]x w = v x w.
[[nodiscard]] Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// Converts a rotation vector (rad) to a rotation, and back.
[[nodiscard]] Eigen::Matrix3d rotation_about(const Eigen::Vector3d& rotation_vector);
[[nodiscard]] Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation);

}  // namespace drape
