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
  double blur_px = 0;                                            ///< s
  double chi2_per_dof = 0;
  double misfit = 0;        ///< rms of the residuals, in contrasts
  double masked_edge = 0;   ///< fraction of the outline hidden by masks or the image border
  double one_sided = 0;     ///< largest chi-square of the centre's shift when an eighth is left out
  double one_sided_px = 0;  ///< the shift itself
  bool saturated = false;
  std::optional<double> centre_fraction;  ///< light of the core: 0 as the print, 1 as the cloth
  EdgeResiduals edge;
};

/// Fits one blob by damped Gauss-Newton steps; pixels near other dark regions are left out.
/// `light_centre_fraction`: radius of the light centre that some dots of the print have, in radii
/// of the dot; 0 when none has. `with_ring`: also what the ring around the dot says of the cloth's
/// texture, which a few dots of a frame are enough to tell.
[[nodiscard]] DotFit fit_dot(const GreyImage& image, const DarkMap& map, const NoiseModel& noise,
                             const Blob& start, const BlurGuess& blur,
                             double light_centre_fraction = 0, bool with_ring = false);

/// Edge width that a blob's fit alone finds; nothing when no ellipse fits or its outline is partly
/// covered.
[[nodiscard]] std::optional<double> blur_of_dot(const GreyImage& image, const DarkMap& map,
                                                const NoiseModel& noise, const Blob& start,
                                                double light_centre_fraction);

/// See correlation_of().
[[nodiscard]] Correlation frame_correlation(const std::vector<DotFit>& fits);

/// Covariance of the centre with the noise and the correlation that the residuals show.
[[nodiscard]] Eigen::Matrix2d honest_covariance(const DotFit& fit, const Correlation& correlation);

}  // namespace drape::detect
