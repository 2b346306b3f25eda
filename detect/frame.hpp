// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/detections.hpp"
#include "detect/image/image.hpp"
#include "detect/labels/print_plane.hpp"
#include "detect/tags/tags.hpp"

namespace drape::detect {

/// Limits beyond which a dot is not measured but rejected with the reason.
struct FrameLimits {
  double most_chi2_per_dof = 0;
  double most_misfit = 0;
  double most_masked_edge = 0;
  double most_one_sided = 0;
  double most_one_sided_px = 0;
  double least_semi_axis_px = 0;
  double most_sigma_px = 0;
};

/// Finds, fits and labels the marks of one decoded frame; a colour sensor's raw mosaic is brought
/// to one level first. Fills everything but the names, the image's hash and the preview. `blur_px`:
/// Gaussian width of the dots' edges, median over the good fits; 0 without any.
[[nodiscard]] FrameDetections detect_frame(const GreyImage& picture, const PrintPlane& plane,
                                           TagFinder& finder, const FrameLimits& limits,
                                           double* blur_px = nullptr);

}  // namespace drape::detect
