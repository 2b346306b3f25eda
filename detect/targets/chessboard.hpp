// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/detections.hpp"
#include "core/rig.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

/// Finds the inner corners of a chessboard, or those of a part whose position on the board is
/// certain. OpenCV finds and orders them; `find_corner_point` refines each in a window of a
/// quarter of the distance to its nearest neighbour: on real pictures a fraction of 0.35
/// touches the neighbours' edges, and 0.15 wastes signal. Corner (0, 0) lies on a dark square
/// of the board (see core/rig.hpp), so that labels of two cameras agree in any orientation of
/// board and camera. The covariance has the shape from the fit and the magnitude of the
/// corners' scatter about a smooth map of the board. A frame without a board gets one rejection
/// that says so.
[[nodiscard]] FrameDetections detect_chessboard(const GreyImage& image, const Target& target);

}  // namespace drape::detect
