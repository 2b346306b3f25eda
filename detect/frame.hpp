// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/detections.hpp"
#include "detect/image/image.hpp"
#include "detect/labels/print_plane.hpp"
#include "detect/tags/tags.hpp"

namespace drape::detect {

/// Limits beyond which a dot is not measured but rejected with the reason. Radii are the
/// dot's own semi-major axis.
struct FrameLimits {
  double most_chi2_per_dof = 60;   ///< chi-square of the fit, in units of the frame's noise
  double most_misfit = 0.08;       ///< rms of its residuals in contrasts; both must be exceeded
  double most_masked_edge = 0.25;  ///< fraction of a dot's outline that may be covered
  double most_one_sided = 30;  ///< chi-square of the leave-an-eighth-out shift, per chi2_per_dof
  double most_one_sided_radii = 0.03;  ///< the shift itself; both must be exceeded
  double least_semi_axis_px = 1.35;    ///< smaller ellipses hold too few pixels
  double most_sigma_radii = 0.03;      ///< largest standard deviation of a usable centre
};

/// Finds, fits and labels the marks of one decoded frame; a colour sensor's raw mosaic is brought
/// to one level first. Fills everything but the names, the image's hash and the preview. `blur_px`:
/// Gaussian width of the dots' edges, median over the good fits; 0 without any.
[[nodiscard]] FrameDetections detect_frame(const GreyImage& picture, const PrintPlane& plane,
                                           TagFinder& finder, const FrameLimits& limits,
                                           double* blur_px = nullptr);

}  // namespace drape::detect
