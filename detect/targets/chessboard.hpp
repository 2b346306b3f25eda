// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/detections.hpp"
#include "core/rig.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

/// Inner corners of a chessboard target, or those of a part of it whose place on the board is
/// certain. OpenCV finds and orders them; each is then placed by `find_corner_point` in a window of
/// its own, a quarter of the distance to its nearest neighbour to each side: measured on real
/// pictures, a window of 0.35 already meets the neighbours' edges, and one of 0.15 wastes light.
/// Corner (0, 0) lies on a dark square of the board (see core/rig.hpp), so that the labels of two
/// cameras agree however the board or a camera is turned. The covariance has the fit's shape and
/// the size that the frame's corners show by their scatter about a smooth map of the board.
/// A frame without a board gets one rejection that says so.
[[nodiscard]] FrameDetections detect_chessboard(const GreyImage& image, const Target& target);

/// True when the board looks the same upside down, so that no picture tells corner (0, 0) from the
/// opposite one.
[[nodiscard]] bool is_ambiguous(const Target& target);

}  // namespace drape::detect
