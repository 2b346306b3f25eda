// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
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

/// Finds the inner corners of a chessboard, or those of a part whose position on the board is
/// certain. OpenCV finds and orders them; `find_corner_point` refines each in a window of a
/// quarter of the distance to its nearest neighbour: on real pictures 0.35 touches the
/// neighbours' edges, and 0.15 wastes signal. Corner (0, 0) lies on a dark square of the
/// board (see core/rig.hpp), so that labels of two cameras agree in any orientation of board
/// and camera. The covariance has the shape from the fit and the magnitude of the corners'
/// scatter about a smooth map of the board. A frame without a board gets one rejection that
/// says so.
[[nodiscard]] FrameDetections detect_chessboard(const GreyImage& image, const Target& target);

/// Finds the corners of a target without dots: a chessboard by detect_chessboard(), a ChArUco board
/// or an AprilGrid, of which any part suffices, by tags that predict each corner. The operator of
/// Foerstner and Guelch (1987) refines it in a window clear of tags. Tags are identified by id and
/// position, so the print may have any of four orientations. A corner that is hidden, or predicted
/// where there is none, is rejected with the reason. Throws Error(bad_input) for an unknown tag
/// family.
[[nodiscard]] FrameDetections detect_board(const GreyImage& image, const Target& target);

/// Tests whether an AprilGrid's `border_modules` is wrong: if tags are missing in the picture and
/// another border width reads more than the `found` ones. Names the key to change in `file`; empty
/// otherwise.
[[nodiscard]] std::string other_border(const GreyImage& image, const Target& target,
                                       std::size_t found, const std::string& file);

/// Grey dilation: each pixel becomes the lightest of those up to `by_px` away in x and in y, which
/// separates dark shapes that touch at a corner. 8 bits only.
[[nodiscard]] GreyImage with_light_grown(const GreyImage& image, int by_px);

/// Corners in the original picture of a dark quadrilateral found in the dilated one: moves each
/// edge outwards by the amount that the square window removed.
[[nodiscard]] Eigen::Matrix<double, 2, 4> without_growth(
    const Eigen::Matrix<double, 2, 4>& corners_px, int by_px);

}  // namespace drape::detect
