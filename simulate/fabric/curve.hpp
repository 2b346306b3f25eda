// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/certificate.hpp"

namespace drape::simulate {

/// Sampled force or moment per width over strain, shear angle (rad) or curvature (1/m), SI, as
/// one branchless curve: x >= 0 and increasing, first point at the origin.
struct SampledCurve {
  std::vector<double> x;
  std::vector<double> f;

  [[nodiscard]] double at(double position) const;  ///< linear in between
};

/// A piecewise linear law as an initial slope and changes of slope:
///   f(x) = slope x + sum over hinges of change * max(0, x - at),
/// beyond the last hinge the last slope goes on. The form needs no search for the segment.
struct ForceCurve {
  struct Hinge {
    double at = 0;
    double change = 0;
  };
  double slope = 0;
  std::vector<Hinge> hinges;

  /// Odd continuation for shear and bending: f(-x) = -f(x).
  [[nodiscard]] double odd_value(double x) const { return std::copysign(value(std::abs(x)), x); }
  /// Continued with the initial slope for x < 0 (compression of a spring).
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
  /// Derivative of value(); at a knot that of the segment before it. For an odd law pass |x|.
  [[nodiscard]] double tangent(double x) const {
    double t = slope;
    for (const Hinge& hinge : hinges) t += x > hinge.at ? hinge.change : 0.0;
    return t;
  }
  [[nodiscard]] bool rises() const;  ///< every slope is positive
  /// Largest tangent slope for any argument up to x.
  [[nodiscard]] double steepest_up_to(double x) const;
};

/// An approximation of a measured curve and how well it does.
struct FittedCurve {
  ForceCurve curve;
  double range = 0;          ///< the fit covers 0 .. range
  double rms_error = 0;      ///< root mean square of fit minus measurement over that range
  double largest_error = 0;  ///< over that range
};

/// Mean slope: least squares line through the origin over 0 .. range (paper section 5; G and B).
[[nodiscard]] FittedCurve fit_line(const SampledCurve& measured, double range);

/// Continuous piecewise linear curve of `segments` pieces through the origin over the whole
/// measured range. The knots are points of the measured curve, chosen by dynamic programming to
/// minimise the squared error. Fewer pieces are used when they fit to 1e-5 of the largest force.
[[nodiscard]] FittedCurve fit_segments(const SampledCurve& measured, int segments);

/// The same where the cloth lives: the pieces lie in 0 .. reach, to where a drape strains its
/// cloth, and the last goes on from there to the end of the measurement. In 0 .. reach the root
/// mean square error is never above that of one line, and every slope is positive where the line's
/// is. A reach below the measurement's first point, or too short for a rising line, is widened to
/// the next point that is not.
[[nodiscard]] FittedCurve fit_reached(const SampledCurve& measured, int segments, double reach);

}  // namespace drape::simulate
