// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "core/detections.hpp"
#include "core/rig.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

/// Corners of a target that is no dot grid. A chessboard must be seen whole (chessboard.hpp). Of a
/// ChArUco board or an AprilGrid any part will do: its tags say where each corner must be, and
/// Foerstner and Guelch's operator (1987) places it in a window that no tag reaches into. Tags are
/// identified by ids and places, so any of the four orientations of the print will do.
/// A corner that is covered, or where the tags' corner meets nothing, is rejected with the reason.
/// Throws Error(bad_input) for a tag family that is not known.
[[nodiscard]] FrameDetections detect_board(const GreyImage& image, const Target& target);

/// The picture in which each pixel is the lightest of those up to `by_px` away in x and in y, so
/// that dark shapes which touch at a corner come apart. 8 bits only.
[[nodiscard]] GreyImage with_light_grown(const GreyImage& image, int by_px);

/// Corners of a dark quadrangle of that picture where they were in the picture itself: each edge
/// moved outwards by what the square window took from it.
[[nodiscard]] Eigen::Matrix<double, 2, 4> without_growth(
    const Eigen::Matrix<double, 2, 4>& corners_px, int by_px);

}  // namespace drape::detect
