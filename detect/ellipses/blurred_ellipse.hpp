// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace drape::detect {

/// A printed ellipse under a lens: I = (b + bx x + by y) (1 - k Phi(-d / s)) with d the signed
/// distance from the outline |M (p - c)| = 1, positive outside. Light multiplies the print, so a
/// slope of the light moves no edge. The light's origin is that of the coordinates.
class BlurredEllipse {
 public:
  static constexpr int size = 10;
  using Vector = Eigen::Matrix<double, size, 1>;
  using Matrix = Eigen::Matrix<double, size, size>;
  enum Parameter { light, light_x, light_y, print, cx, cy, m11, m12, m22, blur };

  explicit BlurredEllipse(const Vector& parameters) : p_(parameters) {}

  /// Level and derivative at a position. `gradient` beyond `print` is set only when the
  /// answer says that the position is near the edge.
  struct Sample {
    double level = 0;
    bool near_edge = false;
  };
  Sample evaluate(double x, double y, Vector& gradient) const {
    const Distance at = distance(x, y);
    const double base = p_(light) + p_(light_x) * x + p_(light_y) * y;
    const double z = at.d / p_(blur);
    const bool near_edge = std::abs(z) < far_in_blurs;
    const double covered = near_edge ? normal_cdf(-z) : (z < 0 ? 1.0 : 0.0);
    const double through = 1 - p_(print) * covered;
    gradient(light) = through;
    gradient(light_x) = x * through;
    gradient(light_y) = y * through;
    gradient(print) = -base * covered;
    if (near_edge) {
      const double by_distance = base * p_(print) * normal_density(z) / p_(blur);
      const double fraction = by_distance / at.norm_w;
      gradient(cx) = -fraction * at.wx;
      gradient(cy) = -fraction * at.wy;
      gradient(m11) = fraction * at.vx * at.ux;
      gradient(m22) = fraction * at.vy * at.uy;
      gradient(m12) = fraction * (at.vx * at.uy + at.vy * at.ux);
      gradient(blur) = -by_distance * z;
    }
    return {base * through, near_edge};
  }

  /// Signed distance from the outline to first order (Sampson 1982).
  [[nodiscard]] double signed_distance(double x, double y) const { return distance(x, y).d; }

  /// Distance from the centre in radii of the ellipse.
  [[nodiscard]] double radius(double x, double y) const {
    const Distance at = distance(x, y);
    return std::sqrt(at.vx * at.vx + at.vy * at.vy);
  }

  /// Which eighth of the dot a position lies in, 0..7, in the coordinates where it is a circle.
  [[nodiscard]] int sector(double x, double y) const {
    const Distance at = distance(x, y);
    return sector_of(at.vx, at.vy);
  }
  [[nodiscard]] static int sector_of(double vx, double vy) {
    return (vx < 0 ? 1 : 0) + (vy < 0 ? 2 : 0) + (std::abs(vx) > std::abs(vy) ? 4 : 0);
  }

  /// At the centre the first-order distance is undefined; this far out, in radii, it is taken.
  static constexpr double shallowest = 0.3;
  /// The distance there.
  [[nodiscard]] double deepest() const {
    return -(1 - shallowest) * shallowest / std::max(shallowest * outline_norm(), 1e-9);
  }

  [[nodiscard]] double light_at_centre() const {
    return p_(light) + p_(light_x) * p_(cx) + p_(light_y) * p_(cy);
  }
  [[nodiscard]] Eigen::Matrix2d outline() const {
    Eigen::Matrix2d m;
    m << p_(m11), p_(m12), p_(m12), p_(m22);
    return m;
  }
  [[nodiscard]] const Vector& parameters() const { return p_; }

 private:
  // Beyond this the edge changes the level by less than 0.03 % of the contrast.
  static constexpr double far_in_blurs = 3.5;

  struct Distance {
    double d = 0, ux = 0, uy = 0, vx = 0, vy = 0, wx = 0, wy = 0, norm_w = 1;
  };

  Distance distance(double x, double y) const {
    Distance r;
    r.ux = x - p_(cx);
    r.uy = y - p_(cy);
    r.vx = p_(m11) * r.ux + p_(m12) * r.uy;
    r.vy = p_(m12) * r.ux + p_(m22) * r.uy;
    r.wx = p_(m11) * r.vx + p_(m12) * r.vy;
    r.wy = p_(m12) * r.vx + p_(m22) * r.vy;
    r.norm_w = std::max(std::sqrt(r.wx * r.wx + r.wy * r.wy), 1e-9);
    const double rho = std::sqrt(r.vx * r.vx + r.vy * r.vy);
    r.d = rho < shallowest ? deepest() : (rho - 1) * rho / r.norm_w;
    return r;
  }
  [[nodiscard]] double outline_norm() const {
    return std::sqrt(p_(m11) * p_(m11) + 2 * p_(m12) * p_(m12) + p_(m22) * p_(m22));
  }

  static double normal_cdf(double z) { return 0.5 * std::erfc(-z * 0.70710678118654752440); }
  static double normal_density(double z) { return 0.39894228040143267794 * std::exp(-0.5 * z * z); }

  Vector p_;
};

}  // namespace drape::detect
