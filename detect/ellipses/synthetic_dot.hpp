// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "detect/dots/blobs.hpp"
#include "detect/image/image.hpp"

namespace drape::test {

using namespace detect;

/// A drawn dot with a known centre, for the tests of the fit.
struct SyntheticDot {
  Eigen::Vector2d centre_px{32, 32};
  Eigen::Matrix2d shape_px2 = 64.0 * Eigen::Matrix2d::Identity();
  double bright = 190;
  double contrast = 120;
  double slope_per_px = 0;    ///< relative change of the light along u
  double lens_blur_px = 0.6;  ///< Gaussian sigma before the pixel's own extent
  double noise = 2;           ///< grey levels
  int bits = 8;               ///< of a pixel
  /// Variance of rounding, grey levels squared.
  [[nodiscard]] double rounding() const { return std::ldexp(1.0 / 12, 2 * (8 - bits)); }
  double texture = 0;          ///< rms of a weave in grey levels of the bright cloth, 1 px long
  double hidden_from_u = 1e9;  ///< unprinted cloth covers the dot beyond this u
};

/// 64x64 picture: exact coverage of each pixel, Gaussian blur, light, noise, rounding.
[[nodiscard]] GreyImage draw(const SyntheticDot& dot, std::mt19937& random);

/// What a perfect threshold would find: the start of the fit, off by a third of a pixel.
[[nodiscard]] Blob blob_of(const SyntheticDot& dot);

}  // namespace drape::test
