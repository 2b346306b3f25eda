// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "detect/blobs.hpp"
#include "detect/image.hpp"
#include "detect/noise.hpp"

namespace drape {

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
  /// Chi-square per pixel where the centre is sensitive (the outline): 1 for the frame's noise.
  double edge_chi2 = 0;
  /// The same with products of neighbouring residuals, that is, correlated noise, included.
  double edge_chi2_correlated = 0;
};

/// Fits one blob by damped Gauss-Newton steps; pixels near other dark regions are left out.
[[nodiscard]] DotFit fit_dot(const GreyImage& image, const DarkMap& map, const NoiseModel& noise,
                             const Blob& start, const BlurGuess& blur);

/// How much correlation between residuals widens the covariances of a frame: >= 1, from the fits
/// that converged (the truncated sandwich estimate of Newey & West 1987, pooled).
[[nodiscard]] double correlation_factor(const std::vector<DotFit>& fits);

/// Covariance of the centre with the noise that the residuals show.
[[nodiscard]] Eigen::Matrix2d honest_covariance(const DotFit& fit, double correlation_factor);

}  // namespace drape
