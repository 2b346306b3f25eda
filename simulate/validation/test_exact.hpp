// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <numbers>

namespace drape::simulate {

inline constexpr double kPi = std::numbers::pi;

}  // namespace drape::simulate

namespace drape::simulate::exact {

/// A heavy strip clamped horizontally (inextensible heavy elastica); lengths in units of its
/// length. `gamma` is rho g L^3 / B. Width W and height H of its shape, tip angle below the
/// horizontal. Solved by shooting in the variable for which all gamma lie on one curve; accurate to
/// 1e-6.
struct Cantilever {
  double gamma = 0, width = 0, height = 0, tip_rad = 0;
  [[nodiscard]] Eigen::Vector2d at(double arc) const;  ///< from the clamp: horizontally and up
};
[[nodiscard]] Cantilever cantilever(double gamma);
/// The one whose chord from clamp to tip hangs at this angle (Peirce 1930: 41.5 degrees).
[[nodiscard]] Cantilever cantilever_at_chord_angle(double chord_rad);

/// Loop of a strip whose ends are clamped together pointing up (Peirce 1930). Distance from the
/// clamp to the lowest point, in units of the strip's length.
[[nodiscard]] double heart_loop_height(double gamma);

/// Sag of an inextensible chain without bending over a chord shorter than its length (= 1).
[[nodiscard]] double catenary_sag(double chord);

/// Pinned strut (Euler): load over pi^2 B / L^2 and chord over length for the end slope alpha.
struct Elastica {
  double load = 0, chord = 0;
};
[[nodiscard]] Elastica elastica(double alpha_rad);

/// rho g L^3 / B at which a clamped vertical strip buckles under its weight (Greenhill 1881).
inline constexpr double kSelfBuckling = 7.8373474;

/// A heavy strip clamped pointing down whose tip stands on a flat floor directly below the clamp,
/// which is lower than the strip is long: a planar elastica held at its tip only by one force.
/// Units: its length L and B / L^2. With less friction than this force requires, the tip slips
/// (Sano, Yamaguchi and Wada 2017).
struct PressedStrip {
  double gamma = 0;                       ///< rho g L^3 / B
  double give = 0;                        ///< B / (K L^2), K its tensile modulus
  double curvature = 0;                   ///< at the clamp
  double tangential = 0;                  ///< force of the floor on the tip, sideways,
  double normal = 0;                      ///< and upwards
  [[nodiscard]] double friction() const;  ///< least coefficient for which the tip stays
  struct Place {
    double sideways = 0, drop = 0;
  };
  [[nodiscard]] Place at(double arc) const;  ///< position at an arc length, seen from the clamp
};
/// `lowered`: strip length minus height of the clamp above the floor, relative to the length.
[[nodiscard]] PressedStrip pressed_strip(double gamma, double give, double lowered);

/// Tension at which a heavy belt sliding over half of a horizontal cylinder leaves it, for the
/// tension `slack_n_per_m` at which it enters; friction mu, belt weight per length and width.
[[nodiscard]] double capstan_tension(double slack_n_per_m, double mu, double weight_n_per_m2,
                                     double radius_m);

}  // namespace drape::simulate::exact
