// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

#include "core/error.hpp"

namespace cv {
class Mat;
}

namespace drape {

/// Decodes a PNG, JPEG, TIFF, BMP, PGM or PPM as stored by the sensor, 8 or 16 bit, grey or colour
/// (BGR); ignores a tag for rotation or mirroring in every format. Throws Error(bad_input) at
/// `where` for pixels that are not plain intensities: several pages, black and white exchanged,
/// inks or other colours, transparency, or another depth.
[[nodiscard]] cv::Mat decode_picture(std::span<const unsigned char> bytes, const Where& where,
                                     std::string_view remedy);

/// Orientation tag of EXIF or TIFF: 1 if upright or absent, 2 to 8 if rotated or mirrored.
[[nodiscard]] int orientation_of(std::span<const unsigned char> bytes);

}  // namespace drape
