// SPDX-License-Identifier: Apache-2.0
#include "detect/dots/dark_map.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace drape::detect {
namespace {

/// Position of the first marked pixel at or after x.
int next_marked(const std::uint8_t* line, int x, int width) {
  for (std::uint64_t eight = 0; x + 8 <= width; x += 8) {
    std::memcpy(&eight, line + x, sizeof eight);
    if (eight != 0) break;
  }
  while (x < width && line[x] == 0) ++x;
  return x;
}

}  // namespace

RegionFinder::RegionFinder(int width_px, int height_px) {
  map_.width_px = width_px;
  map_.height_px = height_px;
  map_.row_begins.reserve(static_cast<std::size_t>(height_px) + 1);
  map_.row_begins.push_back(0);
}

int RegionFinder::root_of(int run) {
  while (parents_[run] != run) {
    parents_[run] = parents_[parents_[run]];
    run = parents_[run];
  }
  return run;
}

void RegionFinder::join(int a, int b) {
  const int first = root_of(a), second = root_of(b);
  parents_[std::max(first, second)] = std::min(first, second);
}

void RegionFinder::add_row(const std::uint8_t* marked) {
  const int width = map_.width_px;
  std::vector<DarkRun>& runs = map_.runs;
  const std::size_t above_end = runs.size();
  std::size_t touching =
      map_.row_begins.size() > 1 ? map_.row_begins[map_.row_begins.size() - 2] : above_end;
  for (int x = next_marked(marked, 0, width); x < width; x = next_marked(marked, x, width)) {
    int end = x;
    while (end < width && marked[end] != 0) ++end;
    const int index = static_cast<int>(runs.size());
    runs.push_back({x, end, 0});
    parents_.push_back(index);
    while (touching < above_end && runs[touching].to < x) ++touching;
    for (std::size_t k = touching; k < above_end && runs[k].from <= end; ++k) {
      join(static_cast<int>(k), index);
    }
    x = end;
  }
  map_.row_begins.push_back(runs.size());
}

std::vector<Region> RegionFinder::finish(DarkMap& map) {
  std::vector<Region> regions;
  for (int y = 0; y < map_.height_px; ++y) {
    for (std::size_t k = map_.row_begins[y]; k < map_.row_begins[y + 1]; ++k) {
      DarkRun& run = map_.runs[k];
      const int root = root_of(static_cast<int>(k));
      if (root == static_cast<int>(k)) {
        regions.push_back({run.from, y, 0, 0, 0});
        run.label = static_cast<std::int32_t>(regions.size());
      }
      run.label = map_.runs[root].label;
      Region& region = regions[run.label - 1];
      const int right = std::max(region.left + region.width, run.to);
      region.left = std::min(region.left, run.from);
      region.width = right - region.left;
      region.height = y - region.top + 1;
      region.area += run.to - run.from;
    }
  }
  map = std::move(map_);
  return regions;
}

}  // namespace drape::detect
