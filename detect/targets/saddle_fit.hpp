// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "detect/image/image.hpp"
#include "detect/targets/corner_point.hpp"

namespace drape::detect {

/// Point where two straight edges cross, by least squares of the grey levels in the round window of
/// `radius_px` about it: I = (m + k S(p)) (1 + g p), S the product of the two edges' signs under a
/// Gaussian blur, g the gradient of the light. Pixels are used as they are, without interpolation.
/// Nothing where the window leaves the image or no two edges cross in it.
[[nodiscard]] std::optional<CornerPoint> fit_saddle(const GreyImage& image,
                                                    const Eigen::Vector2d& start_px,
                                                    double radius_px);

}  // namespace drape::detect
