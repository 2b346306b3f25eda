// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "detect/blobs.hpp"

namespace drape {

/// A connected set of marked pixels: its bounding box and pixel count.
struct Region {
  int left = 0, top = 0, width = 0, height = 0;
  double area = 0;
};

/// Labels the pixels of `mask` that are not 0 by regions connected along sides and corners, in the
/// order of their first pixels; region k of the answer has label k + 1 in `map`, whose size must be
/// set. Works on runs of marked pixels, so that the empty rest costs next to nothing.
[[nodiscard]] std::vector<Region> connected_regions(const std::vector<std::uint8_t>& mask,
                                                    DarkMap& map);

}  // namespace drape
