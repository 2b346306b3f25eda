// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "detect/dots/noise.hpp"
#include "detect/ellipses/blurred_ellipse.hpp"
#include "detect/ellipses/patch.hpp"
#include "detect/ellipses/pixel_columns.hpp"

namespace drape::detect {

/// Texture of the cloth in the bright ring around a dot: sums of products of residuals, in units of
/// noise, over pixel pairs by distance.
struct RingResiduals {
  static constexpr std::array<int, 10> distances = {0, 1, 2, 4, 5, 8, 9, 10, 13, 18};  ///< px^2
  static constexpr int count = static_cast<int>(distances.size());
  using Sums = Eigen::Matrix<double, count, 1>;
  Sums product = Sums::Zero();
  double pixels = 0;
  /// Expected products (rows) per unit of texture correlation (columns); below 1, since the fit
  /// absorbs part of the texture.
  Eigen::Matrix<double, count, count> seen = Eigen::Matrix<double, count, count>::Zero();
};

/// Residuals near the outline, where the centre is sensitive, summed over pixel pairs by squared
/// distance in px^2 (0: each pixel with itself).
struct EdgeResiduals {
  static constexpr int classes = 19;  ///< pairs up to 3 pixels apart in both directions
  double chi2 = 0;  ///< weighted by a pixel's influence on the centre; 1 for pure noise
  std::array<double, classes> product = {};  ///< products of residuals, in units of noise
  std::array<double, classes> pairs = {};
  std::array<double, classes> influence = {};  ///< products of the centre's sensitivities
  double light = 1;                            ///< variance of texture here over that in the ring
  std::optional<RingResiduals> ring;           ///< only if requested for the fit
};

/// A finished fit of a patch.
struct FittedPatch {
  const Patch& patch;
  const PixelColumns& pixels;
  const NoiseModel& noise;
  const BlurredEllipse& model;
  const BlurredEllipse::Matrix& covariance;
};

[[nodiscard]] EdgeResiduals edge_residuals(const FittedPatch& fit, bool with_ring);

/// Correlation of the noise in a frame, pooled over its fits: cloth texture and lens blur correlate
/// neighbouring pixels.
struct Correlation {
  /// Correlation of residuals near outlines, by squared distance.
  std::array<double, EdgeResiduals::classes> at = {};
  /// Texture in addition to the frame's white noise, in units of its variance, from the rings.
  RingResiduals::Sums texture = RingResiduals::Sums::Zero();
};
[[nodiscard]] Correlation correlation_of(const std::vector<const EdgeResiduals*>& dots);

/// Factor by which a centre's variance exceeds that of white noise: sandwich estimator of
/// generalised least squares with the outline's residuals or the ring's texture, whichever is
/// larger. The residuals include misfits but lack the texture absorbed by the fit; the ring's do
/// not.
[[nodiscard]] double excess_of(const EdgeResiduals& dot, const Correlation& correlation);

}  // namespace drape::detect
