// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/certificate.hpp"

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

}  // namespace drape::simulate
