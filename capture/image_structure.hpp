// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

namespace drape::capture {

/// File formats a recording may hold.
enum class ImageFormat { png, jpeg, tiff };

/// Format by the first bytes, whatever the file's name says.
[[nodiscard]] std::optional<ImageFormat> image_format(std::span<const unsigned char> bytes);

/// Why the file is not a whole image of its format ("ends inside chunk IDAT"), or nothing.
/// Needed because the image decoder fills the missing part of a truncated file with grey and says
/// nothing. PNG: every chunk and its CRC up to IEND. JPEG: every segment and scan up to the end
/// marker. TIFF: every directory entry and every strip or tile of the first page inside the file.
[[nodiscard]] std::optional<std::string> structure_fault(ImageFormat format,
                                                         std::span<const unsigned char> bytes);

}  // namespace drape::capture
