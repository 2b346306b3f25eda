// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace drape::detect {

/// Blurred image of a printed ellipse: I = (b + bx x + by y) (1 - k Phi(-d / s)), with d the signed
/// distance from the outline |M (p - c)| = 1, positive outside. Light multiplies the print, so a
/// gradient of the light does not shift the edge. The light is relative to the coordinates' origin.
class BlurredEllipse {
 public:
  static constexpr int size = 10;
  using Vector = Eigen::Matrix<double, size, 1>;
  using Matrix = Eigen::Matrix<double, size, size>;
  enum Parameter { light, light_x, light_y, print, cx, cy, m11, m12, m22, blur };

  explicit BlurredEllipse(const Vector& parameters) : p_(parameters) {}

  /// Distance from the centre in radii of the ellipse.
  [[nodiscard]] double radius(double x, double y) const {
    return (outline() * Eigen::Vector2d(x - p_(cx), y - p_(cy))).norm();
  }

  /// Least radius at which the first-order distance is evaluated; at the centre it is undefined.
  static constexpr double shallowest = 0.3;
  /// The distance at that radius.
  [[nodiscard]] double deepest() const {
    return -(1 - shallowest) * shallowest / std::max(shallowest * outline().norm(), 1e-9);
  }

  /// Grey level of the unprinted cloth at a position.
  [[nodiscard]] double light_at(double x, double y) const {
    return p_(light) + p_(light_x) * x + p_(light_y) * y;
  }
  [[nodiscard]] double light_at_centre() const { return light_at(p_(cx), p_(cy)); }
  [[nodiscard]] Eigen::Matrix2d outline() const {
    Eigen::Matrix2d m;
    m << p_(m11), p_(m12), p_(m12), p_(m22);
    return m;
  }
  [[nodiscard]] const Vector& parameters() const { return p_; }

 private:
  Vector p_;
};

}  // namespace drape::detect
