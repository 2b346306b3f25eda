// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "detect/image/image.hpp"

namespace drape::detect {

/// The picture in which each pixel is the lightest of those up to `by_px` away in x and in y, so
/// that dark shapes which touch at a corner come apart. 8 bits only.
[[nodiscard]] GreyImage with_light_grown(const GreyImage& image, int by_px);

/// Corners of a dark quadrangle of that picture where they were in the picture itself: each edge
/// moved outwards by what the square window took from it.
[[nodiscard]] Eigen::Matrix<double, 2, 4> without_growth(
    const Eigen::Matrix<double, 2, 4>& corners_px, int by_px);

}  // namespace drape::detect
