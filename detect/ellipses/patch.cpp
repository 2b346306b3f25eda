// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/patch.hpp"

#include <algorithm>
#include <cmath>

#include "core/statistics/sample.hpp"
#include "detect/ellipses/lanes.hpp"

namespace drape::detect {

namespace {

constexpr double ring_px = 4.0;         // width of the ring of pixels used outside the outline
constexpr double edge_px = 1.5;         // width of the band along the outline, for lost fractions
constexpr int foreign_margin_px = 2;    // range of blur from a neighbouring dark region
constexpr double centre_margin = 0.25;  // around a light centre, in radii of the dot
constexpr double dark_ring_fraction = 0.7;
constexpr double saturated_level = 254.5;

/// Signed distances of a row of pixels from an outline (first order, Sampson 1982), and the pixels
/// in coordinates in which the outline is the unit circle.
struct Row {
  std::vector<double> d, vx, vy;
  explicit Row(int count) : d(count), vx(count), vy(count) {}

  /// Which eighth of the dot a pixel lies in.
  [[nodiscard]] int sector(int k) const {
    return (vx[k] < 0 ? 1 : 0) + (vy[k] < 0 ? 2 : 0) + (std::abs(vx[k]) > std::abs(vy[k]) ? 4 : 0);
  }
};

/// Fills the row from pixel (first_x, y) rightwards.
DRAPE_WIDE_VECTORS void fill(const BlurredEllipse& model, int first_x, int y, Row& row) {
  using Model = BlurredEllipse;
  const Model::Vector& p = model.parameters();
  const double cx = p(Model::cx), m11 = p(Model::m11), m12 = p(Model::m12), m22 = p(Model::m22);
  const double uy = y - p(Model::cy), deepest = model.deepest();
  double* const __restrict d = row.d.data();
  double* const __restrict to_vx = row.vx.data();
  double* const __restrict to_vy = row.vy.data();
  const int count = static_cast<int>(row.d.size());
  for (int k = 0; k < count; ++k) {
    const double ux = static_cast<double>(first_x + k) - cx;
    const double vx = m11 * ux + m12 * uy, vy = m12 * ux + m22 * uy;
    const double wx = m11 * vx + m12 * vy, wy = m12 * vx + m22 * vy;
    const double norm = std::max(std::sqrt(wx * wx + wy * wy), 1e-9);
    const double rho = std::sqrt(vx * vx + vy * vy);
    const double out = (rho - 1) * rho / norm;
    d[k] = rho < Model::shallowest ? deepest : out;
    to_vx[k] = vx;
    to_vy[k] = vy;
  }
}

/// Marks the pixels of the patch that other dark regions affect.
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
  Row row(width);
  for (int y = -patch.reach_y; y <= patch.reach_y; ++y) {
    fill(start, -patch.reach_x, y, row);
    for (int k = 0; k < width; ++k, ++index) {
      const int x = k - patch.reach_x;
      const double d = row.d[k];
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
      patch.saturated =
          patch.saturated || (image.negative ? 255 - level : level) >= saturated_level;
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
  const double limit = dark_ring_fraction * order_statistic(levels, levels.size() * 3 / 4);
  bool any = false;
  for (PatchPixel* pixel : ring) {
    if (pixel->level >= limit) continue;
    pixel->trust = 0;
    any = true;
  }
  return any;
}

}  // namespace drape::detect
