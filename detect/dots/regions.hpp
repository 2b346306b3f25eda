// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "detect/dots/dark_map.hpp"

namespace drape::detect {

/// A connected set of marked pixels: its bounding box and pixel count.
struct Region {
  int left = 0, top = 0, width = 0, height = 0;
  double area = 0;
};

/// Finds regions of marked pixels that are connected along sides and corners, row by row. Works on
/// runs of marked pixels, so that the empty rest costs next to nothing and no picture is stored.
class RegionFinder {
 public:
  RegionFinder(int width_px, int height_px);

  /// The next row from the top: `width_px` bytes, not 0 where a pixel is marked.
  void add_row(const std::uint8_t* marked);

  /// Once all rows are there: the regions in the order of their first pixels. Region k of the
  /// answer has label k + 1 in `map`.
  [[nodiscard]] std::vector<Region> finish(DarkMap& map);

 private:
  [[nodiscard]] int root_of(int run);
  void join(int a, int b);

  DarkMap map_;
  std::vector<int> parents_;  ///< by run: a run of the same region that is not later
};

}  // namespace drape::detect
