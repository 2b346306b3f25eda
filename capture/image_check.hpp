// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "core/error.hpp"

namespace drape::capture {

struct ImageSize {
  int width_px = 0, height_px = 0;
  bool operator==(const ImageSize&) const = default;
};

/// Checks that `bytes` are one complete PNG, JPEG or TIFF image by walking its structure and
/// decoding it; returns the size of the stored pixels (an orientation tag is not applied). Throws
/// Error(bad_input) at `where` otherwise.
[[nodiscard]] ImageSize check_image(std::span<const unsigned char> bytes, const Where& where);

}  // namespace drape::capture
