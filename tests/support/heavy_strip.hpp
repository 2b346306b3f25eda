// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <vector>

#include "core/units.hpp"
#include "simulate/fabric/laws.hpp"

/// A strip with internal friction as a boundary-value problem.
namespace drape::simulate::test {

/// Cotton broad of Matsudaira et al. 2015: B, 2HB and density.
inline constexpr double kStiffness = 0.118 * units::gf_cm2_per_cm;          // N m
inline constexpr double kFrictionMoment = 0.124 / 2 * units::gf_cm_per_cm;  // N
inline constexpr double kSlipCurvature = 0.1 * units::per_cm;               // 1/m
inline constexpr double kDensity = 0.1238;                                  // kg/m2
inline constexpr double kGravity = 9.80665;                                 // m/s2

inline FrictionStack stack_of(double friction_moment) {
  return {{{friction_moment / kSlipCurvature, friction_moment, 0}}};
}

inline ClothLaws cotton(double length, double friction_moment) {
  ClothLaws laws;
  laws.density_kg_per_m2 = kDensity;
  laws.tensile[0] = laws.tensile[1] = {3e4 * kDensity * kGravity * length, {}};
  laws.shear = {1, {}};
  laws.bending[0] = laws.bending[1] = {kStiffness, {}};
  laws.twist_n_m = 2 * kStiffness;
  laws.friction = ClothFriction{{stack_of(friction_moment), stack_of(friction_moment)}, {}};
  return laws;
}

/// A heavy inextensible strip with the same law, clamped horizontally: theta' = curvature(M), M' =
/// -w (L - s) cos theta, theta(0) = 0, M(L) = 0, by shooting with Heun's rule; every point keeps
/// its slip from load to load.
class HeavyStrip {
 public:
  explicit HeavyStrip(double length, double friction_moment = kFrictionMoment)
      : length_(length),
        element_(stack_of(friction_moment).elements.front()),
        slip_(kPieces + 1, 0.0) {}

  void load(double weight_n_per_m2) {
    weight_ = weight_n_per_m2;
    double low = 0, high = 0.5 * weight_ * length_ * length_;  // N, bounds of the clamp's moment
    for (int k = 0; k < 100; ++k) {
      const double middle = 0.5 * (low + high);
      (shoot(middle) > 0 ? high : low) = middle;
    }
    (void)shoot(low);
    for (int j = 0; j <= kPieces; ++j) slip_[j] = element_.settled(curvature_[j], slip_[j]);
  }
  double x = 0, z = 0;  ///< position of the tip

 private:
  static constexpr int kPieces = 2000;

  /// Curvature for which the law gives this moment; the law is monotonic.
  [[nodiscard]] double curvature_of(double moment, double slip) const {
    const double sticking =
        (moment + element_.stiffness * slip) / (kStiffness + element_.stiffness);
    const double pull = element_.stiffness * (sticking - slip);
    if (std::abs(pull) <= element_.threshold) return sticking;
    return (moment - std::copysign(element_.threshold, pull)) / kStiffness;
  }
  /// Moment at the tip.
  double shoot(double root_moment) {
    const double h = length_ / kPieces;
    double theta = 0, moment = root_moment;
    x = z = 0;
    curvature_.assign(kPieces + 1, 0.0);
    for (int j = 0; j <= kPieces; ++j) {
      curvature_[j] = curvature_of(moment, slip_[j]);
      if (j == kPieces) break;
      const double fall = -weight_ * (length_ - j * h) * std::cos(theta);
      const double ahead = theta + h * curvature_[j];
      const double fall_ahead = -weight_ * (length_ - (j + 1) * h) * std::cos(ahead);
      const double next =
          theta + 0.5 * h * (curvature_[j] + curvature_of(moment + h * fall, slip_[j + 1]));
      moment += 0.5 * h * (fall + fall_ahead);
      x += 0.5 * h * (std::cos(theta) + std::cos(next));
      z -= 0.5 * h * (std::sin(theta) + std::sin(next));
      theta = next;
    }
    return moment;
  }

  double length_, weight_ = 0;
  SlipElement element_;
  std::vector<double> slip_, curvature_;
};

}  // namespace drape::simulate::test
