// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "detect/image/image.hpp"

namespace drape::detect {

inline constexpr int kLeastHalfWindow_px = 2;  ///< of a corner

/// The point where the edges around it meet.
struct CornerPoint {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d normal_matrix;  ///< the centre's information, (grey levels / px)^2
  Eigen::Matrix2d score_squares;  ///< sum over four directions of the score's square
  int half_window_px = 0;         ///< used: smaller than asked for at the picture's edge
};

/// The point where two blurred edges cross (`saddle_fit.hpp`) in a window of `half_window_px` to
/// each side; where that fit fails, as on glare, the point q that minimises the sum of
/// w (g (p - q))^2 (Foerstner and Guelch 1987): g the grey-level gradient at p, w a Gaussian.
/// The window shrinks until it is inside the picture. Nothing when no window has room there, the
/// edges do not determine a point, or it wanders out of its window.
[[nodiscard]] std::optional<CornerPoint> find_corner_point(const GreyImage& image,
                                                           const Eigen::Vector2d& start_px,
                                                           int half_window_px);

}  // namespace drape::detect
