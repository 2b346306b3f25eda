// SPDX-License-Identifier: Apache-2.0
#include "detect/regions.hpp"

#include <algorithm>
#include <cstring>

namespace drape {
namespace {

struct Run {
  int row, from, to;  ///< pixels from .. to - 1
  int parent;         ///< index of a run of the same region that is not later
};

int root_of(std::vector<Run>& runs, int k) {
  while (runs[k].parent != k) {
    runs[k].parent = runs[runs[k].parent].parent;
    k = runs[k].parent;
  }
  return k;
}

void join(std::vector<Run>& runs, int a, int b) {
  const int first = root_of(runs, a), second = root_of(runs, b);
  runs[std::max(first, second)].parent = std::min(first, second);
}

/// First marked pixel at or after x.
int next_marked(const std::uint8_t* line, int x, int width) {
  for (std::uint64_t eight = 0; x + 8 <= width; x += 8) {
    std::memcpy(&eight, line + x, sizeof eight);
    if (eight != 0) break;
  }
  while (x < width && line[x] == 0) ++x;
  return x;
}

std::vector<Run> runs_of(const std::vector<std::uint8_t>& mask, int width, int height) {
  std::vector<Run> runs;
  std::size_t above = 0, above_end = 0;  // runs of the row before
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* line = mask.data() + static_cast<std::size_t>(y) * width;
    const std::size_t begin = runs.size();
    std::size_t touching = above;
    for (int x = next_marked(line, 0, width); x < width; x = next_marked(line, x, width)) {
      int end = x;
      while (end < width && line[end] != 0) ++end;
      const int index = static_cast<int>(runs.size());
      runs.push_back({y, x, end, index});
      while (touching < above_end && runs[touching].to < x) ++touching;
      for (std::size_t k = touching; k < above_end && runs[k].from <= end; ++k) {
        join(runs, static_cast<int>(k), index);
      }
      x = end;
    }
    above = begin;
    above_end = runs.size();
  }
  return runs;
}

}  // namespace

std::vector<Region> connected_regions(const std::vector<std::uint8_t>& mask, DarkMap& map) {
  std::vector<Run> runs = runs_of(mask, map.width_px, map.height_px);
  map.labels.assign(mask.size(), 0);
  std::vector<Region> regions;
  std::vector<std::int32_t> labels(runs.size(), 0);
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Run& run = runs[k];
    const int root = root_of(runs, static_cast<int>(k));
    if (root == static_cast<int>(k)) {
      regions.push_back({run.from, run.row, 0, 0, 0});
      labels[k] = static_cast<std::int32_t>(regions.size());
    }
    labels[k] = labels[root];
    Region& region = regions[labels[k] - 1];
    const int right = std::max(region.left + region.width, run.to);
    region.left = std::min(region.left, run.from);
    region.width = right - region.left;
    region.height = run.row - region.top + 1;
    region.area += run.to - run.from;
    std::fill(map.labels.begin() + static_cast<std::ptrdiff_t>(run.row) * map.width_px + run.from,
              map.labels.begin() + static_cast<std::ptrdiff_t>(run.row) * map.width_px + run.to,
              labels[k]);
  }
  return regions;
}

}  // namespace drape
