// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/error.hpp"

namespace cv {
class Mat;
}

namespace drape::detect {

/// A grey image. Pixel (0, 0) is the centre of the top-left pixel.
struct GreyImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> bytes;  ///< row-major, 0..255
  /// For 16-bit sources only: the same picture at full depth, on the scale 0..255.
  std::vector<float> levels;
  bool negative = false;  ///< light and dark are exchanged

  /// Grey level 0..255 of a pixel; the pixel must be inside the image.
  [[nodiscard]] float level(int x, int y) const {
    const std::size_t index = static_cast<std::size_t>(y) * width_px + x;
    return levels.empty() ? static_cast<float>(bytes[index]) : levels[index];
  }
};

/// View of the picture's bytes, without a copy, for OpenCV to read.
[[nodiscard]] cv::Mat view_of(const GreyImage& image);

/// Mirrors the picture left to right.
[[nodiscard]] GreyImage mirrored(GreyImage image);

/// Exchanges light and dark.
[[nodiscard]] GreyImage negative_of(GreyImage image);

/// Decodes PNG, JPEG or TIFF; converts colour to grey and keeps the depth of 16 bits. Throws
/// Error(bad_input) at `where` if the bytes are not a picture, the depth is neither 8 nor 16 bit,
/// or the size is not `width_px` x `height_px`.
[[nodiscard]] GreyImage decode_image(std::span<const unsigned char> bytes, int width_px,
                                     int height_px, const Where& where);

/// JPEG of the picture at half size, for reports. Deterministic.
[[nodiscard]] std::vector<unsigned char> half_scale_jpeg(const GreyImage& image);

/// Equalises the raw mosaic of a colour sensor that was read as grey: the four positions of each
/// 2x2 pixels see the same white cloth at different levels. Scales each to the brightest one's
/// level by its own gain (median over smooth regions); nullopt for a picture whose four positions
/// agree within 3 %.
[[nodiscard]] std::optional<GreyImage> without_mosaic(const GreyImage& image);

/// Noise of one frame: variance = floor + slope * level (read-out and quantisation noise plus the
/// shot noise of a linear sensor), in grey levels of the 0..255 scale.
struct NoiseModel {
  double floor_variance = 1;
  double slope = 0;

  [[nodiscard]] double variance(double level) const;
  [[nodiscard]] double sigma(double level) const;
};

/// Estimates the noise from the frame itself: median response, in bands of brightness, of
/// Immerkaer's (1996) difference operator, which cancels planes.
[[nodiscard]] NoiseModel estimate_noise(const GreyImage& image);

}  // namespace drape::detect
