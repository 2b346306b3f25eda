// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace drape::simulate {

/// A curvature vector c projected on the normal of the sheet, n = a x b / |a x b|, with tangents a
/// and b. Unlike |c| it has a sign, which friction elements need, and it rotates with the sheet.
struct NormalCurvature {
  double value = 0;
  Eigen::Vector3d of_c, of_a, of_b;  ///< gradient by c, a and b
};
[[nodiscard]] inline NormalCurvature normal_curvature(const Eigen::Vector3d& c,
                                                      const Eigen::Vector3d& a,
                                                      const Eigen::Vector3d& b) {
  const Eigen::Vector3d across = a.cross(b);
  const double size = std::max(across.norm(), 1e-12 * a.norm() * b.norm() + 1e-300);
  const Eigen::Vector3d n = across / size;
  const double value = c.dot(n);
  const Eigen::Vector3d of_across = (c - value * n) / size;
  return {value, n, b.cross(of_across), of_across.cross(a)};
}

}  // namespace drape::simulate
