// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/detections.hpp"
#include "core/rig.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

/// Finds the corners of a target without dots. A chessboard must be seen whole (chessboard.hpp).
/// For a ChArUco board or an AprilGrid any part suffices: the tags predict each corner, and the
/// operator of Foerstner and Guelch (1987) refines it in a window clear of tags. Tags are
/// identified by id and position, so the print may have any of four orientations. A corner that is
/// hidden, or predicted where there is none, is rejected with the reason. Throws Error(bad_input)
/// for an unknown tag family.
[[nodiscard]] FrameDetections detect_board(const GreyImage& image, const Target& target);

/// Finds out whether an AprilGrid's `border_modules` is wrong: if tags are missing in the picture
/// and another width of their border reads more than the `found` ones. Names the key to change in
/// `file`; empty otherwise.
[[nodiscard]] std::string other_border(const GreyImage& image, const Target& target,
                                       std::size_t found, const std::string& file);

/// Grey dilation: each pixel becomes the lightest of those up to `by_px` away in x and in y, which
/// separates dark shapes that touch at a corner. 8 bits only.
[[nodiscard]] GreyImage with_light_grown(const GreyImage& image, int by_px);

/// Corners in the original picture of a dark quadrilateral found in the dilated one: each edge is
/// moved outwards by the amount that the square window removed.
[[nodiscard]] Eigen::Matrix<double, 2, 4> without_growth(
    const Eigen::Matrix<double, 2, 4>& corners_px, int by_px);

}  // namespace drape::detect
