// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>

/// Vectors of the checker, in long double.
namespace drape::simulate::checker {

using Real = long double;
using Point = std::array<Real, 3>;

[[nodiscard]] inline Point point_of(const Eigen::Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}
/// a + factor b
[[nodiscard]] inline Point plus(const Point& a, const Point& b, Real factor = 1) {
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}
[[nodiscard]] inline Point minus(const Point& a, const Point& b) {
  return plus(a, b, -1);
}
[[nodiscard]] inline Point times(Real factor, const Point& a) {
  return {factor * a[0], factor * a[1], factor * a[2]};
}
[[nodiscard]] inline Real dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline Real length(const Point& a) {
  return std::sqrt(dot(a, a));
}

}  // namespace drape::simulate::checker
