// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/detections.hpp"
#include "detect/image/image.hpp"
#include "detect/labels/print_plane.hpp"
#include "detect/tags/tags.hpp"

namespace drape::detect {

/// Limits beyond which a dot is rejected, with the reason. Radii are the dot's own semi-major
/// axis.
struct FrameLimits {
  double most_chi2_per_dof = 60;   ///< chi-square per degree of freedom, for the frame's noise
  double most_misfit = 0.08;       ///< rms residual over contrast; both limits must be exceeded
  double most_masked_edge = 0.25;  ///< fraction of a dot's outline that may be hidden
  double most_one_sided = 30;      ///< chi-square of the shift without one eighth, per chi2_per_dof
  double most_one_sided_radii = 0.03;  ///< the shift itself; both limits must be exceeded
  double least_semi_axis_px = 1.35;    ///< smaller ellipses cover too few pixels
  double most_sigma_radii = 0.03;      ///< largest allowed standard deviation of a centre
};

/// Finds, fits and labels the marks of one decoded frame; first equalises the raw mosaic of a
/// colour sensor. Fills in everything but the names, the image's hash and the preview. `blur_px`
/// receives the Gaussian width of the dot edges, median over the good fits; 0 if there are none.
[[nodiscard]] FrameDetections detect_frame(const GreyImage& picture, const PrintPlane& plane,
                                           TagFinder& finder, const FrameLimits& limits,
                                           double* blur_px = nullptr);

}  // namespace drape::detect
