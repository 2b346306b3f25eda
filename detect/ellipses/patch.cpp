// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/patch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "detect/ellipses/row_distances.hpp"

namespace drape::detect {
namespace {

constexpr double ring_px = 4.0;         // how far outside the outline pixels are used
constexpr double edge_px = 1.5;         // what counts as outline when lost fractions are counted
constexpr int foreign_margin_px = 2;    // blur carries a neighbour's darkness this far
constexpr double centre_margin = 0.25;  // around a light centre, in radii of the dot
constexpr double dark_ring_fraction = 0.7;
constexpr double saturated_level = 254.5;

/// Marks the pixels of the patch that other dark regions touch.
std::vector<char> foreign_pixels(const DarkMap& map, const Blob& blob, const Patch& patch) {
  const int width = 2 * patch.reach_x + 1, height = 2 * patch.reach_y + 1;
  const int left = patch.origin.x() - patch.reach_x, top = patch.origin.y() - patch.reach_y;
  const int m = foreign_margin_px;
  std::vector<char> foreign(static_cast<std::size_t>(width) * height, 0);
  for (int y = -m; y < height + m; ++y) {
    for (const DarkRun& run : map.row_from(left - m, top + y)) {
      const int from = std::max(0, run.from - left - m), to = std::min(width, run.to - left + m);
      if (from >= width) break;
      if (run.label == blob.label) continue;
      for (int v = std::max(0, y - m); v <= std::min(height - 1, y + m); ++v) {
        char* const line = foreign.data() + static_cast<std::ptrdiff_t>(v) * width;
        std::fill(line + from, line + std::max(from, to), 1);
      }
    }
  }
  return foreign;
}

double& nth(std::vector<double>& values, std::size_t n) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(n);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace

Patch cut_patch(const GreyImage& image, const DarkMap& map, const Blob& blob,
                const BlurredEllipse& start, double light_centre_fraction) {
  Patch patch;
  patch.origin = blob.centre_px.array().round().cast<int>();
  patch.reach_x = static_cast<int>(std::ceil(std::sqrt(blob.shape_px2(0, 0)) + ring_px)) + 1;
  patch.reach_y = static_cast<int>(std::ceil(std::sqrt(blob.shape_px2(1, 1)) + ring_px)) + 1;
  const std::vector<char> foreign = foreign_pixels(map, blob, patch);
  patch.pixels.reserve(foreign.size());
  int edge = 0, hidden = 0;
  std::size_t index = 0;
  const int width = 2 * patch.reach_x + 1;
  RowDistances row(width);
  for (int y = -patch.reach_y; y <= patch.reach_y; ++y) {
    row.fill(start, -patch.reach_x, y);
    for (int k = 0; k < width; ++k, ++index) {
      const int x = k - patch.reach_x;
      const double d = row.distance(k);
      if (d > ring_px) continue;
      if (light_centre_fraction > 0 && d < -edge_px &&
          start.radius(x, y) < light_centre_fraction + centre_margin) {
        continue;
      }
      const int u = patch.origin.x() + x, v = patch.origin.y() + y;
      const bool inside = u >= 0 && v >= 0 && u < image.width_px && v < image.height_px;
      const bool usable = inside && foreign[index] == 0;
      const bool on_edge = std::abs(d) < edge_px;
      edge += on_edge;
      hidden += on_edge && !usable;
      if (!usable) continue;
      const double level = image.level(u, v);
      patch.saturated = patch.saturated || level >= saturated_level;
      patch.pixels.push_back({x, y, level, d, row.sector(k), 1.0});
    }
  }
  patch.masked_edge = edge == 0 ? 1.0 : static_cast<double>(hidden) / edge;
  return patch;
}

bool set_dark_ring_aside(Patch& patch) {
  std::vector<double> levels;
  std::vector<PatchPixel*> ring;
  for (PatchPixel& pixel : patch.pixels) {
    if (pixel.distance < edge_px) continue;
    ring.push_back(&pixel);
    levels.push_back(pixel.level);
  }
  if (levels.empty()) return false;
  const double limit = dark_ring_fraction * nth(levels, levels.size() * 3 / 4);
  bool any = false;
  for (PatchPixel* pixel : ring) {
    if (pixel->level >= limit) continue;
    pixel->trust = 0;
    any = true;
  }
  return any;
}

}  // namespace drape::detect
