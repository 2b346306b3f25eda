// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace drape::detect {

/// Pixels from .. to - 1 of one row that belong to one region.
struct DarkRun {
  int from = 0, to = 0;
  std::int32_t label = 0;  ///< the region's number, from 1
};

/// Printed (dark) connected regions of a frame: below half the light on the surface around them.
/// Kept as runs: a picture of labels would be four times as large as the frame.
struct DarkMap {
  int width_px = 0;
  int height_px = 0;
  std::vector<DarkRun> runs;            ///< row by row, from left to right
  std::vector<std::size_t> row_begins;  ///< first run of each row, and the number of all runs

  [[nodiscard]] std::span<const DarkRun> row(int y) const {
    const std::size_t first = row_begins[static_cast<std::size_t>(y)];
    return {runs.data() + first, row_begins[static_cast<std::size_t>(y) + 1] - first};
  }

  /// Runs of a row that end right of x; none outside the image.
  [[nodiscard]] std::span<const DarkRun> row_from(int x, int y) const {
    if (y < 0 || y >= height_px) return {};
    const std::span<const DarkRun> all = row(y);
    const auto first = std::partition_point(all.begin(), all.end(),
                                            [x](const DarkRun& run) { return run.to <= x; });
    return all.subspan(static_cast<std::size_t>(first - all.begin()));
  }

  /// Region at a pixel; 0 where nothing is printed and outside the image.
  [[nodiscard]] std::int32_t at(int x, int y) const {
    const std::span<const DarkRun> runs_from = row_from(x, y);
    return runs_from.empty() || runs_from.front().from > x ? 0 : runs_from.front().label;
  }
};

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
