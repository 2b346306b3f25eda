// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "detect/image/image.hpp"

namespace drape::detect {

/// Noise of one frame: variance = floor + slope * level (read-out and quantisation noise plus the
/// shot noise of a linear sensor), grey levels of the 0..255 scale.
struct NoiseModel {
  double floor_variance = 1;
  double slope = 0;

  [[nodiscard]] double variance(double level) const;
  [[nodiscard]] double sigma(double level) const;
};

/// Estimates the noise from the frame itself: the response of Immerkaer's (1996) difference
/// operator, which cancels planes, taken by robust median in bands of brightness.
[[nodiscard]] NoiseModel estimate_noise(const GreyImage& image);

}  // namespace drape::detect
