// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

#include "core/error.hpp"

namespace cv {
class Mat;
}

namespace drape {

/// Pixels of a PNG, JPEG, TIFF, BMP, PGM or PPM as the sensor wrote them, 8 or 16 bit, grey or
/// colour (BGR): a tag that asks for a turn or a mirror image is not obeyed, in any format. Throws
/// Error(bad_input) at `where` for what has another meaning than its numbers: several pages, black
/// and white exchanged, inks or other colours, transparent pixels, another depth.
[[nodiscard]] cv::Mat decode_picture(std::span<const unsigned char> bytes, const Where& where,
                                     std::string_view remedy);

/// EXIF's or TIFF's orientation tag: 1 upright or absent, 2 to 8 turned or mirrored.
[[nodiscard]] int orientation_of(std::span<const unsigned char> bytes);

}  // namespace drape
