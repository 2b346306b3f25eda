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

}  // namespace drape::detect
