// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/error.hpp"

namespace drape::capture {

/// Image formats that a recording may contain.
enum class ImageFormat { png, jpeg, tiff };

/// Detects the format from the first bytes, independent of the file name.
[[nodiscard]] std::optional<ImageFormat> image_format(std::span<const unsigned char> bytes);

/// Explains why the file is not a complete image ("ends inside chunk IDAT"); nullopt if it is.
/// Needed because the decoder silently fills the missing part of a truncated file with grey. PNG:
/// every chunk and its CRC up to IEND. JPEG: every segment and scan up to the end marker. TIFF:
/// every directory entry, and every strip or tile of the first page, inside the file.
[[nodiscard]] std::optional<std::string> structure_fault(ImageFormat format,
                                                         std::span<const unsigned char> bytes);

struct ImageSize {
  int width_px = 0, height_px = 0;
  bool operator==(const ImageSize&) const = default;
};

/// Checks that `bytes` are one complete PNG, JPEG or TIFF image by walking its structure and
/// decoding it; returns the size of the stored pixels (an orientation tag is not applied). Throws
/// Error(bad_input) at `where` otherwise.
[[nodiscard]] ImageSize check_image(std::span<const unsigned char> bytes, const Where& where);

}  // namespace drape::capture
