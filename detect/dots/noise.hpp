// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "detect/image/image.hpp"

namespace drape::detect {

/// Noise of one frame: variance = floor + slope * level (read-out and quantisation noise plus the
/// shot noise of a linear sensor), in grey levels of the 0..255 scale.
struct NoiseModel {
  double floor_variance = 1;
  double slope = 0;

  [[nodiscard]] double variance(double level) const;
  [[nodiscard]] double sigma(double level) const;
};

/// Estimates the noise from the frame itself: median response, in bands of brightness, of
/// Immerkaer's (1996) difference operator, which cancels planes.
[[nodiscard]] NoiseModel estimate_noise(const GreyImage& image);

}  // namespace drape::detect
