// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/tsai/correspondence.hpp"
#include "core/camera_model.hpp"

namespace drape::calib {

/// Points whose pixels are moved from the centroid of the dot's image to the image of the dot's
/// centre, as the camera predicts it for level dots of this diameter (Heikkila 2000).
[[nodiscard]] std::vector<Correspondence> without_eccentricity(
    const std::vector<Correspondence>& points, const Camera& camera, double dot_diameter_m);

/// Largest distance (px) between the pixels of two lists of the same points.
[[nodiscard]] double largest_shift_px(const std::vector<Correspondence>& a,
                                      const std::vector<Correspondence>& b);

}  // namespace drape::calib
