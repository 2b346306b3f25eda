// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/detections.hpp"
#include "core/rig.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

inline constexpr int kLeastHalfWindow_px = 2;  ///< smallest half window of a corner

/// The point where the edges around it meet.
struct CornerPoint {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d normal_matrix;  ///< the centre's information, (grey levels / px)^2
  Eigen::Matrix2d score_squares;  ///< sum over four directions of the score's square
  int half_window_px = 0;         ///< used: smaller than asked for at the picture's edge
};

/// The point where two blurred edges cross (fit_saddle()) in a window of `half_window_px` to
/// each side; where that fit fails, as on glare, the point q that minimises the sum of
/// w (g (p - q))^2 (Foerstner and Guelch 1987): g the grey-level gradient at p, w a Gaussian.
/// The window shrinks until it is inside the picture. Nothing when no window has room there, the
/// edges do not determine a point, or it wanders out of its window.
[[nodiscard]] std::optional<CornerPoint> find_corner_point(const GreyImage& image,
                                                           const Eigen::Vector2d& start_px,
                                                           int half_window_px);

/// Point where two straight edges cross, by least squares of the grey levels in the round window of
/// `radius_px` about it: I = (m + k S(p)) (1 + g p), S the product of the two edges' signs under a
/// Gaussian blur, g the gradient of the light. Pixels are used as they are, without interpolation.
/// Nothing where the window leaves the image or no two edges cross in it.
[[nodiscard]] std::optional<CornerPoint> fit_saddle(const GreyImage& image,
                                                    const Eigen::Vector2d& start_px,
                                                    double radius_px);

/// Projective map with the least sum of squared distances in the picture; nothing for points on one
/// line.
[[nodiscard]] std::optional<Eigen::Matrix3d> projective_map(
    const std::vector<Eigen::Vector2d>& from, const std::vector<Eigen::Vector2d>& to);

/// Gives each corner of a frame the operator's covariance, scaled so that the frame's mean variance
/// is what its corners scatter by along the target's lines. Corners whose own directions disagree
/// more have a larger chi-square. `points` belong to `frame.detections`, one each.
void set_corner_covariances(const Target& target, const std::vector<CornerPoint>& points,
                            FrameDetections& frame);

}  // namespace drape::detect
