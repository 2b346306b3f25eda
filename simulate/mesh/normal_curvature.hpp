// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace drape::simulate {

/// A curvature vector c seen along the normal of the sheet, n = a x b / |a x b| with a and b along
/// it: it has a sign, which a friction element has to know, and turns with the sheet.
struct NormalCurvature {
  double value = 0;
  Eigen::Vector3d of_c, of_a, of_b;  ///< its gradient
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

/// The angle by which a and b depart from a right angle.
struct ShearAngle {
  double value = 0, sine = 0, cosine = 1;
  Eigen::Vector3d of_a, of_b;
};
[[nodiscard]] inline ShearAngle shear_angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const double la = std::max(a.norm(), 1e-150), lb = std::max(b.norm(), 1e-150);
  const Eigen::Vector3d ua = a / la, ub = b / lb;
  ShearAngle angle;
  angle.sine = std::clamp(ua.dot(ub), -1.0, 1.0);
  angle.cosine = std::sqrt(std::max(1e-6, 1 - angle.sine * angle.sine));  // as the elastic forces
  angle.value = std::asin(angle.sine);
  angle.of_a = (ub - angle.sine * ua) / (la * angle.cosine);
  angle.of_b = (ua - angle.sine * ub) / (lb * angle.cosine);
  return angle;
}

}  // namespace drape::simulate
