// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/error.hpp"

namespace cv {
class Mat;
}

namespace drape::detect {

/// One grey image. Pixel (0, 0) is the centre of the top-left pixel.
struct GreyImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> bytes;  ///< row-major, 0..255
  /// 16-bit sources only: the same picture on the scale 0..255 with its full depth.
  std::vector<float> levels;
  bool negative = false;  ///< light and dark exchanged

  /// Grey level 0..255 of a pixel inside the image.
  [[nodiscard]] float level(int x, int y) const {
    const std::size_t index = static_cast<std::size_t>(y) * width_px + x;
    return levels.empty() ? static_cast<float>(bytes[index]) : levels[index];
  }
};

/// The picture's bytes without a copy, for OpenCV to read.
[[nodiscard]] cv::Mat view_of(const GreyImage& image);

/// The picture seen in a mirror: left and right exchanged.
[[nodiscard]] GreyImage mirrored(GreyImage image);

/// The picture with light and dark exchanged.
[[nodiscard]] GreyImage negative_of(GreyImage image);

/// Decodes PNG, JPEG or TIFF bytes; colour becomes grey, 16-bit keeps its depth. Throws
/// Error(bad_input) with `where` when the bytes are no picture, have another depth than 8 or 16
/// bit, or a size other than `width_px` x `height_px`.
[[nodiscard]] GreyImage decode_image(std::span<const unsigned char> bytes, int width_px,
                                     int height_px, const Where& where);

/// JPEG of the picture at half its size, for reports. The same picture gives the same bytes.
[[nodiscard]] std::vector<unsigned char> half_scale_jpeg(const GreyImage& image);

/// A colour sensor's raw mosaic read as grey: the four places of each 2x2 pixels see the same white
/// cloth at different levels. Answers with the picture brought to the brightest place's level, each
/// place by its own gain (median over smooth places of the picture); nothing for a picture whose
/// four places agree within 3 %.
[[nodiscard]] std::optional<GreyImage> without_mosaic(const GreyImage& image);

}  // namespace drape::detect
