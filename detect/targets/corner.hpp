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

/// The point where the edges around it intersect.
struct CornerPoint {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d normal_matrix;  ///< information matrix of the centre, (grey levels / px)^2
  Eigen::Matrix2d score_squares;  ///< sum of squared scores over four directions
  int half_window_px = 0;         ///< window used: smaller than requested near the picture's border
};

/// Locates a corner in a window of `half_window_px` to each side: where two blurred edges cross
/// (fit_saddle()) or, if that fit fails, as on glare, the point q that minimises the sum of w (g (p
/// - q))^2 (Foerstner and Guelch 1987), with g the grey-level gradient at p and w a Gaussian. The
/// window shrinks to fit into the picture. nullopt if no window fits, the edges do not determine a
/// point, or it drifts out of its window.
[[nodiscard]] std::optional<CornerPoint> find_corner_point(const GreyImage& image,
                                                           const Eigen::Vector2d& start_px,
                                                           int half_window_px);

/// Fits the crossing of two straight edges by least squares to grey levels in a circular window of
/// `radius_px`: I = (m + k S(p)) (1 + g p), with S the product of the signs of both edges under a
/// Gaussian blur and g the gradient of the light. Uses pixels directly, without interpolation.
/// nullopt if the window leaves the image or no two edges cross in it.
[[nodiscard]] std::optional<CornerPoint> fit_saddle(const GreyImage& image,
                                                    const Eigen::Vector2d& start_px,
                                                    double radius_px);

/// Least-squares homography of four or more points, with errors measured in `to`; nullopt if OpenCV
/// finds none.
[[nodiscard]] std::optional<Eigen::Matrix3d> projective_map(
    const std::vector<Eigen::Vector2d>& from, const std::vector<Eigen::Vector2d>& to);

/// Gives each corner of a frame the operator's covariance, scaled to the scatter of the corners
/// along the lines of the target. Corners with inconsistent directions get a larger chi-square.
/// `points` and `frame.detections` correspond.
void set_corner_covariances(const Target& target, const std::vector<CornerPoint>& points,
                            FrameDetections& frame);

}  // namespace drape::detect
