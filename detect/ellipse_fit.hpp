// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

#include "detect/blobs.hpp"
#include "detect/image.hpp"
#include "detect/noise.hpp"

namespace drape {

/// Lags of the residual autocorrelation, one half plane (px).
inline constexpr std::array<std::array<int, 2>, 10> correlation_lags = {
    {{1, 0}, {0, 1}, {1, 1}, {1, -1}, {2, 0}, {0, 2}, {2, 1}, {2, -1}, {1, 2}, {1, -2}}};

/// Sums over residuals that give the autocorrelation of a whole frame.
struct ResidualSums {
  double variance = 0;
  double variance_count = 0;
  std::array<double, correlation_lags.size()> product = {};
  std::array<double, correlation_lags.size()> product_count = {};

  ResidualSums& operator+=(const ResidualSums& other);
  /// Correlation at a lag; zero while nothing was summed.
  [[nodiscard]] double correlation(std::size_t lag) const;
};

/// Width of the edge (px, Gaussian sigma of lens, motion and pixel together) before the fit.
struct BlurGuess {
  double mean_px = 0.7;
  double sigma_px = 0.3;
};

/// A dot fitted as a blurred ellipse under light that multiplies the print:
/// I = (b + bx x + by y) (1 - k Phi(-d / s)), d the signed distance from the ellipse.
struct DotFit {
  bool converged = false;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();  ///< for white noise of the frame
  double contrast = 0;                                           ///< k b, grey levels
  double bright = 0;                                             ///< b at the centre
  double blur_px = 0;                                            ///< s
  double chi2_per_dof = 0;
  double masked_edge = 0;   ///< share of the outline hidden by masks or the image border
  double one_sided = 0;     ///< largest chi-square of the centre's shift when an eighth is left out
  double one_sided_px = 0;  ///< that shift
  bool saturated = false;
  ResidualSums residuals;
  /// Sum over pixel pairs at each lag of the centre's sensitivity products (both directions).
  std::array<Eigen::Matrix2d, correlation_lags.size()> lag_covariance_px2 = {};
};

/// Fits one blob by damped Gauss-Newton steps; pixels near other dark regions are left out.
[[nodiscard]] DotFit fit_dot(const GreyImage& image, const DarkMap& map, const NoiseModel& noise,
                             const Blob& start, const BlurGuess& blur);

/// Covariance of the centre with the noise level and correlation that the residuals show.
[[nodiscard]] Eigen::Matrix2d honest_covariance(const DotFit& fit, const ResidualSums& frame);

}  // namespace drape
