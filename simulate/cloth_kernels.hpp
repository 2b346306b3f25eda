// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "simulate/cloth.hpp"
#include "simulate/wide.hpp"

/// What the inner loops of both models share; every function vectorises.
namespace drape::sim::kernels {

inline constexpr std::size_t kHingesAtOnce = 4;  ///< a curve of five segments

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

/// asin(s) / s for q = s^2 <= 1/4, to 3e-16: the polynomial through 13 Chebyshev nodes.
DRAPE_INLINE double asin_over_sine(double q) {
  double p = 0.03187962140081284;
  p = p * q - 0.016187392271599134;
  p = p * q + 0.019513468251252167;
  p = p * q + 0.0065293020047365695;
  p = p * q + 0.012170138592391726;
  p = p * q + 0.01388484282640208;
  p = p * q + 0.01735977964134998;
  p = p * q + 0.022371749733164054;
  p = p * q + 0.03038195969768514;
  p = p * q + 0.044642856805998936;
  p = p * q + 0.07500000000385201;
  p = p * q + 0.16666666666664942;
  return p * q + 1.0;
}

/// Beyond 30 degrees narrow_asin() does not hold.
DRAPE_INLINE bool is_wide(double sine) {
  return sine * sine > 0.25;
}

DRAPE_INLINE double narrow_asin(double sine) {
  return sine * asin_over_sine(sine * sine);
}

/// For any sine by the half angle, 2 asin(s / sqrt(2 (1 + cos))); to 3e-16 up to 60 degrees, where
/// the half angle's polynomial ends, and to 1e-7 up to 89.
DRAPE_INLINE double wide_asin(double sine) {
  const double cosine = std::sqrt(std::max(1e-6, 1 - sine * sine));
  return 2 * narrow_asin(sine / std::sqrt(2 * (1 + cosine)));
}

}  // namespace drape::sim::kernels
