// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "detect/dots/blobs.hpp"
#include "detect/dots/noise.hpp"
#include "detect/ellipses/residuals.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

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

/// See correlation_of().
[[nodiscard]] Correlation frame_correlation(const std::vector<DotFit>& fits);

/// Covariance of the centre that accounts for the noise and correlation seen in the residuals.
[[nodiscard]] Eigen::Matrix2d honest_covariance(const DotFit& fit, const Correlation& correlation);

}  // namespace drape::detect
