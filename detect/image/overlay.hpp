// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/detections.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

/// PNG of the frame that shows tags (blue), labelled dots (green ellipse, "row,col"), island dots
/// (yellow, "#island row,col") and rejections (red cross).
[[nodiscard]] std::vector<unsigned char> overlay_png(const GreyImage& image,
                                                     const FrameDetections& frame);

}  // namespace drape::detect
