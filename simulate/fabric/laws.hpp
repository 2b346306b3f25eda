// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "core/simulation_files.hpp"

namespace drape::simulate {

/// Sampled force or moment per width over strain, shear angle (rad) or curvature (1/m), in SI
/// units, as a single-valued curve: x >= 0 and increasing, with its first point at the origin.
struct SampledCurve {
  std::vector<double> x;
  std::vector<double> f;

  [[nodiscard]] double at(double position) const;  ///< interpolates linearly
};

/// A piecewise linear law as an initial slope and changes of slope:
///   f(x) = slope x + sum over hinges of change * max(0, x - at),
/// continued beyond the last hinge with the last slope. Evaluation needs no search for a segment.
struct ForceCurve {
  struct Hinge {
    double at = 0;
    double change = 0;
  };
  double slope = 0;
  std::vector<Hinge> hinges;

  /// Odd continuation for shear and bending: f(-x) = -f(x).
  [[nodiscard]] double odd_value(double x) const { return std::copysign(value(std::abs(x)), x); }
  /// Value, continued with the initial slope for x < 0 (compression of a spring).
  [[nodiscard]] double value(double x) const {
    double f = slope * x;
    for (const Hinge& hinge : hinges) f += hinge.change * std::max(0.0, x - hinge.at);
    return f;
  }
  /// Integral of value() from 0 to x; for an odd law pass |x|.
  [[nodiscard]] double energy(double x) const {
    double e = slope * x * x;
    for (const Hinge& hinge : hinges) {
      const double over = std::max(0.0, x - hinge.at);
      e += hinge.change * over * over;
    }
    return 0.5 * e;
  }
  /// Derivative of value(), at a knot that of the preceding segment. For an odd law pass |x|.
  [[nodiscard]] double tangent(double x) const {
    double t = slope;
    for (const Hinge& hinge : hinges) t += x > hinge.at ? hinge.change : 0.0;
    return t;
  }
  [[nodiscard]] bool rises() const;  ///< true if every slope is positive
  /// Largest tangent slope for any argument up to x.
  [[nodiscard]] double steepest_up_to(double x) const;
};

/// Approximation of a measured curve, with its error.
struct FittedCurve {
  ForceCurve curve;
  double range = 0;          ///< the fit covers 0 .. range
  double rms_error = 0;      ///< root mean square of fit minus measurement over that range
  double largest_error = 0;  ///< over that range
};

/// Fits a line through the origin over 0 .. range by least squares (paper section 5; G and B).
[[nodiscard]] FittedCurve fit_line(const SampledCurve& measured, double range);

/// Fits a continuous piecewise linear curve of `segments` pieces through the origin over the whole
/// measured range. Knots are points of the measured curve, chosen by dynamic programming to
/// minimise the squared error. Uses fewer pieces if they fit to 1e-5 of the largest force.
[[nodiscard]] FittedCurve fit_segments(const SampledCurve& measured, int segments);

/// Fits the range used by a drape: the pieces lie in 0 .. reach, the largest strain of the drape,
/// and the last one goes on to the end of the measurement. In 0 .. reach the root mean square error
/// never exceeds that of a single line, and every slope is positive if the line's is. A reach below
/// the first measured point, or too short for a rising line, is extended to the next suitable
/// point.
[[nodiscard]] FittedCurve fit_reached(const SampledCurve& measured, int segments, double reach);

/// Merges the points of two measurements, both above 0 and increasing, from 0 to the nearer end,
/// without repetition. Where one has no point, it is interpolated.
[[nodiscard]] inline std::vector<double> points_of_both(const std::vector<double>& a,
                                                        const std::vector<double>& b) {
  constexpr double kSame = 1e-9;  // relative to the range; closer points are the same
  const double reach = std::min(a.back(), b.back());
  std::vector<double> all;
  std::merge(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  std::vector<double> points = {0};
  for (const double x : all)
    if (x - points.back() > kSame * reach && reach - x > kSame * reach) points.push_back(x);
  points.push_back(reach);
  return points;
}

/// A spring in series with a slider (Jenkin 1922): it follows its strain up to the slider's limit,
/// then slips. The limit may grow with the magnitude of the strain, as in shear (KES 2HG5 above
/// 2HG). It is rate-independent. `x` is a strain, shear angle (rad) or curvature (1/m); `slip`, the
/// element's internal variable, is the x at which its force is zero.
///
/// If `stiffness` exceeds |growth| this is a generalised play operator (Visintin 1994): on a path
/// without reversal the result does not depend on the steps, inner loops close, and a reversal that
/// is passed again is forgotten.
struct SlipElement {
  double stiffness = 0;  ///< N/m per unit of x (N per unit for moments)
  double threshold = 0;  ///< limit of the slider at x = 0, N/m (N for moments)
  double growth = 0;     ///< growth of the limit with |x|

  [[nodiscard]] double limit(double x) const;
  /// Force after a path without reversal from the last settled `slip`.
  [[nodiscard]] double force(double x, double slip) const;
  [[nodiscard]] double tangent(double x, double slip) const;  ///< derivative of force() by x
  /// Integral of force() from `slip` to x: energy stored and dissipated by a step from a settled
  /// state; potential of an implicit step (Ortiz and Stainier 1999).
  [[nodiscard]] double potential(double x, double slip) const;
  /// Slip after that path. The force at x is unchanged.
  [[nodiscard]] double settled(double x, double slip) const;
  [[nodiscard]] double stored(double x, double slip) const;  ///< elastic energy after settling
};

/// Friction elements in parallel (Prandtl 1928, Ishlinskii 1944). Together with the elastic curve
/// in parallel they form the law; this class holds the friction part only.
struct FrictionStack {
  std::vector<SlipElement> elements;

  [[nodiscard]] bool empty() const { return elements.empty(); }
  [[nodiscard]] double stiffness() const;  ///< stiffness of all elements before any slips
  /// Total force; `slip` points to one number per element.
  [[nodiscard]] double force(double x, const double* slip) const;
  [[nodiscard]] double tangent(double x, const double* slip) const;
  [[nodiscard]] double potential(double x, const double* slip) const;
  /// Settles every element; returns the dissipated energy (J per unit of force times x).
  double settle(double x, double* slip) const;
};

/// Friction of bending and shear, in parallel with the elastic curves. Index 0 warp, 1 weft.
struct ClothFriction {
  FrictionStack bending[2];  ///< N as a function of curvature (1/m) along the normal of the sheet
  FrictionStack shear;       ///< N/m as a function of rad
};

/// Slips of all friction elements: in the order of particles (triples by their middle one, cells by
/// their lowest), or of triangles.
struct ClothMemory {
  std::vector<double> bending[2];  ///< 1/m
  std::vector<double> shear;       ///< rad
};

/// Content of memory.csv. Reading throws Error(bad_input) for anything else.
[[nodiscard]] std::string memory_csv(const ClothMemory& memory);
[[nodiscard]] ClothMemory read_memory(const std::filesystem::path& file);

/// A friction stack fitted to a loop, and how well elastic curve and stack reproduce the loop.
struct FittedFriction {
  FrictionStack stack;
  double elastic_range = 0;  ///< below this the mean of the branches is unaffected by the reversal
  double rms_error = 0;      ///< error of the half width over the whole loop
  double largest_error = 0;
};

/// Half the width of a loop over |x|, mean of both signs of x, at increasing x >= 0.
struct HalfWidth {
  std::vector<double> x, h;
};

/// Fits one element to the straight line of width over |x| (least squares; exact for loops made
/// from KES numbers), slipping after at most `slip`, for a loop that is open at its ends.
[[nodiscard]] FittedFriction friction_of_numbers(const HalfWidth& loop, double slip);

/// Fits elements with constant and growing limits and slips of 1/2 .. 1/64 of the range: least
/// squares of their half widths with limits >= 0 (Lawson and Hanson 1974).
[[nodiscard]] FittedFriction friction_of_loop(const HalfWidth& loop);

/// Constitutive laws of a fabric in SI units. Index 0 is warp, 1 weft.
struct ClothLaws {
  double density_kg_per_m2 = 0;
  ForceCurve tensile[2];  ///< N/m as a function of strain
  ForceCurve shear;       ///< N/m as a function of angle in rad, odd
  ForceCurve bending[2];  ///< N as a function of curvature in 1/m, odd
  double twist_n_m = 0;   ///< J in the energy per area 1/2 J kappa12^2
  std::optional<ClothFriction> friction = std::nullopt;  ///< absent without internal friction
};

/// Energies of a cloth's elements (J), by kind.
struct InternalEnergies {
  double stretch_j = 0, shear_j = 0, bending_j = 0, twist_j = 0;
  [[nodiscard]] double sum_j() const { return stretch_j + shear_j + bending_j + twist_j; }
};

}  // namespace drape::simulate
