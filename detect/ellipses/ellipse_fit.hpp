// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "detect/dots/blobs.hpp"
#include "detect/ellipses/pixel_columns.hpp"
#include "detect/image/image.hpp"

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

/// Correlation of the noise in a frame, pooled over its fits: cloth texture and lens blur correlate
/// neighbouring pixels.
struct Correlation {
  /// Correlation of residuals near outlines, by squared distance.
  std::array<double, EdgeResiduals::classes> at = {};
  /// Texture in addition to the frame's white noise, in units of its variance, from the rings.
  RingResiduals::Sums texture = RingResiduals::Sums::Zero();
};
/// Prior of the edge width (px, Gaussian sigma of lens, motion and pixel together).
struct BlurGuess {
  double mean_px = 0.7;
  double sigma_px = 0.3;
};

/// Fit of a dot as a blurred ellipse under light that multiplies the print: I = (b + bx x + by y)
/// (1 - k Phi(-d / s)), d the signed distance from the ellipse.
struct DotFit {
  bool converged = false;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();  ///< for the frame's white noise
  double contrast = 0;                                           ///< k b, grey levels
  double blur_px = 0;                                            ///< s
  double chi2_per_dof = 0;
  double misfit = 0;        ///< rms residual over contrast
  double masked_edge = 0;   ///< fraction of the outline hidden by masks or outside the image
  double one_sided = 0;     ///< largest chi-square of the centre's shift without one eighth
  double one_sided_px = 0;  ///< the shift itself
  bool saturated = false;
  std::optional<double> centre_fraction;  ///< brightness of the core: 0 like print, 1 like cloth
  EdgeResiduals edge;
};

/// Fits one blob by damped Gauss-Newton steps, without pixels near other dark regions.
/// `light_centre_fraction`: radius of the light centre that some dots of the print have, in radii
/// of the dot; 0 if none has. `with_ring`: also evaluate the cloth's texture in the ring around the
/// dot; a few dots per frame suffice.
[[nodiscard]] DotFit fit_dot(const GreyImage& image, const DarkMap& map, const NoiseModel& noise,
                             const Blob& start, const BlurGuess& blur,
                             double light_centre_fraction = 0, bool with_ring = false);

/// Edge width found by the fit of one blob without a prior; nullopt if no ellipse fits or its
/// outline is partly hidden.
[[nodiscard]] std::optional<double> blur_of_dot(const GreyImage& image, const DarkMap& map,
                                                const NoiseModel& noise, const Blob& start,
                                                double light_centre_fraction);

/// Correlation of the noise in the frame of these fits.
[[nodiscard]] Correlation frame_correlation(const std::vector<DotFit>& fits);

/// Covariance of the centre: that of the fit for white noise, times the sandwich estimator of least
/// squares with the correlation of the outline's residuals or of the ring's texture, whichever is
/// larger. The residuals include misfits but lack the texture absorbed by the fit.
[[nodiscard]] Eigen::Matrix2d honest_covariance(const DotFit& fit, const Correlation& correlation);

}  // namespace drape::detect
