// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "detect/cloth_picture.hpp"
#include "detect/detect.hpp"
#include "detect/frame.hpp"

namespace drape::test {

inline constexpr int side = 6;
inline constexpr int all = side * side;

struct Look {
  FrameDetections frame;
  int right = 0, wrong = 0, visible = 0;
  double worst_px = 0;
};

/// 6 x 6 dots of 4 mm at 20 mm, tags of 12 mm in every other cell.
[[nodiscard]] Print small_print(bool classes = false, bool tags = true);

[[nodiscard]] FrameDetections detected(const GreyImage& image, const Print& print);

/// Compares with where the marks were drawn.
[[nodiscard]] Look judged(FrameDetections frame, const ClothPicture& picture);

[[nodiscard]] Look look_at(const ClothPicture& picture, const Print& print);

/// The rejection nearest to a place of the picture; empty when there is none within 10 px.
[[nodiscard]] std::string reason_at(const FrameDetections& frame, const Eigen::Vector2d& px);

[[nodiscard]] bool has(const FrameDetections& frame, MarkId mark);

}  // namespace drape::test
