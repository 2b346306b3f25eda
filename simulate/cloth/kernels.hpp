// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "simulate/cloth/cloth.hpp"
#include "simulate/fabric/wide.hpp"

/// Common parts of the inner loops of both models; every function vectorises.
namespace drape::simulate::kernels {

inline constexpr std::size_t kHingesAtOnce = 4;  ///< a curve of five segments
inline constexpr std::ptrdiff_t kVector = 8;     ///< values of a cache line
inline constexpr double kNoLength2 = 1e-300;     ///< m^2; keeps the inverse of no length finite
inline constexpr double kNoArea2 = 1e-180;       ///< m^4; the same for cells

/// The loops have no rest.
inline std::ptrdiff_t rounded_up(std::ptrdiff_t values) {
  return (values + kVector - 1) / kVector * kVector;
}

/// The first hinges of a law, with changes of 0 where it has fewer.
struct Law {
  explicit Law(const ForceCurve& curve) : slope(curve.slope) {
    for (std::size_t h = 0; h < std::min(kHingesAtOnce, curve.hinges.size()); ++h)
      hinge[h] = curve.hinges[h];
  }
  [[nodiscard]] DRAPE_INLINE double value(double x) const {
    return slope * x + hinge[0].change * std::max(0.0, x - hinge[0].at) +
           hinge[1].change * std::max(0.0, x - hinge[1].at) +
           hinge[2].change * std::max(0.0, x - hinge[2].at) +
           hinge[3].change * std::max(0.0, x - hinge[3].at);
  }
  [[nodiscard]] DRAPE_INLINE double odd_value(double x) const {
    return std::copysign(value(std::abs(x)), x);
  }

  double slope;
  std::array<ForceCurve::Hinge, kHingesAtOnce> hinge{};
};

DRAPE_INLINE double odd_hinge(const ForceCurve::Hinge& hinge, double x) {
  return hinge.change * (std::max(0.0, x - hinge.at) - std::max(0.0, -x - hinge.at));
}

/// atan(t) / t for q = t^2 <= 0.34, to 3e-16: the polynomial through 14 Chebyshev nodes, in pairs
/// (Estrin), which wait for each other less than Horner's steps.
DRAPE_INLINE double atan_over_tangent(double q) {
  const double q2 = q * q, q4 = q2 * q2;
  const double p0 = 1.0 - 0.33333333333332216 * q;
  const double p2 = 0.19999999999785775 - 0.14285714269463612 * q;
  const double p4 = 0.11111110465423782 - 0.09090893653966708 * q;
  const double p6 = 0.07692067230608654 - 0.06664104675185338 * q;
  const double p8 = 0.05863121715404561 - 0.05159775272929573 * q;
  const double p10 = 0.043613881692449646 - 0.03231327711378315 * q;
  const double p12 = 0.01772149287805661 - 0.005103766975673506 * q;
  const double low = (p0 + p2 * q2) + (p4 + p6 * q2) * q4;
  const double high = (p8 + p10 * q2) + p12 * q4;
  return low + high * (q4 * q4);
}

/// Beyond 30 degrees narrow_atan() does not hold.
DRAPE_INLINE bool is_wide(double tangent) {
  return tangent * tangent > 0.34;
}

DRAPE_INLINE double narrow_atan(double tangent) {
  return tangent * atan_over_tangent(tangent * tangent);
}

/// For any tangent below 1e150 by a quarter of the angle, tan(a / 2) = t / (1 + sqrt(1 + t^2)).
DRAPE_INLINE double wide_atan(double tangent) {
  const double half = tangent / (1 + std::sqrt(1 + tangent * tangent));
  return 4 * narrow_atan(half / (1 + std::sqrt(1 + half * half)));
}

}  // namespace drape::simulate::kernels
