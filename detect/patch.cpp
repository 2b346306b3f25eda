// SPDX-License-Identifier: Apache-2.0
#include "detect/patch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace drape {
namespace {

constexpr double ring_px = 4.0;         // how far outside the outline pixels are used
constexpr double edge_px = 1.5;         // what counts as outline when lost shares are counted
constexpr int foreign_margin_px = 2;    // blur carries a neighbour's darkness this far
constexpr double centre_margin = 0.25;  // around a light centre, in radii of the dot
constexpr double dark_ring_share = 0.7;
constexpr double stranger_px = 0.3;     // strangers are sought from here outwards
constexpr double biweight_limit = 6.0;  // in residual scales
constexpr double gross_misfit = 0.15;   // of the contrast
constexpr double noticeable_trust = 0.05;
constexpr double saturated_level = 254.5;

/// Marks the pixels of the patch that other dark regions touch.
std::vector<char> foreign_pixels(const DarkMap& map, const Blob& blob, const Patch& patch) {
  const int width = 2 * patch.reach_x + 1, height = 2 * patch.reach_y + 1;
  const int m = foreign_margin_px;
  std::vector<char> foreign(static_cast<std::size_t>(width) * height, 0);
  for (int y = -m; y < height + m; ++y) {
    for (int x = -m; x < width + m; ++x) {
      const int label =
          map.at(patch.origin.x() - patch.reach_x + x, patch.origin.y() - patch.reach_y + y);
      if (label == 0 || label == blob.label) continue;
      for (int v = std::max(0, y - m); v <= std::min(height - 1, y + m); ++v) {
        for (int u = std::max(0, x - m); u <= std::min(width - 1, x + m); ++u) {
          foreign[static_cast<std::size_t>(v) * width + u] = 1;
        }
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

double Patch::total_trust() const {
  double sum = 0;
  for (const PatchPixel& pixel : pixels) sum += pixel.trust;
  return sum;
}

Patch cut_patch(const GreyImage& image, const DarkMap& map, const Blob& blob,
                const BlurredEllipse& start, double light_centre_share) {
  Patch patch;
  patch.origin = blob.centre_px.array().round().cast<int>();
  patch.reach_x = static_cast<int>(std::ceil(std::sqrt(blob.shape_px2(0, 0)) + ring_px)) + 1;
  patch.reach_y = static_cast<int>(std::ceil(std::sqrt(blob.shape_px2(1, 1)) + ring_px)) + 1;
  const std::vector<char> foreign = foreign_pixels(map, blob, patch);
  patch.pixels.reserve(foreign.size());
  int edge = 0, hidden = 0;
  std::size_t index = 0;
  for (int y = -patch.reach_y; y <= patch.reach_y; ++y) {
    for (int x = -patch.reach_x; x <= patch.reach_x; ++x, ++index) {
      const double d = start.signed_distance(x, y);
      if (d > ring_px) continue;
      if (light_centre_share > 0 && d < -edge_px &&
          start.radius(x, y) < light_centre_share + centre_margin) {
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
      patch.pixels.push_back({x, y, level, start.sector(x, y), 1.0});
    }
  }
  patch.masked_edge = edge == 0 ? 1.0 : static_cast<double>(hidden) / edge;
  return patch;
}

bool set_dark_ring_aside(Patch& patch, const BlurredEllipse& start) {
  std::vector<double> levels;
  std::vector<PatchPixel*> ring;
  for (PatchPixel& pixel : patch.pixels) {
    if (start.signed_distance(pixel.x, pixel.y) < edge_px) continue;
    ring.push_back(&pixel);
    levels.push_back(pixel.level);
  }
  if (levels.empty()) return false;
  const double limit = dark_ring_share * nth(levels, levels.size() * 3 / 4);
  bool any = false;
  for (PatchPixel* pixel : ring) {
    if (pixel->level >= limit) continue;
    pixel->trust = 0;
    any = true;
  }
  return any;
}

Strangers distrust_strangers(Patch& patch, const NoiseModel& noise, const BlurredEllipse& fitted) {
  struct Outside {
    double residual, distance;
    PatchPixel* pixel;
  };
  std::vector<Outside> outside;
  std::vector<double> sizes;
  BlurredEllipse::Vector gradient;
  double edge = 0;
  for (PatchPixel& pixel : patch.pixels) {
    const double d = fitted.signed_distance(pixel.x, pixel.y);
    edge += std::abs(d) < edge_px;
    if (d < stranger_px) continue;
    const double residual = pixel.level - fitted.evaluate(pixel.x, pixel.y, gradient).level;
    outside.push_back({residual, d, &pixel});
    sizes.push_back(std::abs(residual));
  }
  Strangers result;
  if (sizes.empty() || edge == 0) return result;
  const double bright = fitted.light_at_centre();
  const double scale = std::max(noise.sigma(bright), nth(sizes, sizes.size() / 2) / 0.6745);
  const double limit = std::max(biweight_limit * scale,
                                gross_misfit * bright * fitted.parameters()(BlurredEllipse::print));
  for (const auto& [residual, d, pixel] : outside) {
    // Flat up to half the limit: ordinary pixels keep their full say and the rounds end early.
    const double beyond = std::max(0.0, 2 * std::abs(residual) / limit - 1);
    const double keep = std::max(0.0, 1 - beyond * beyond);
    const double trust = keep * keep;
    result.changed = result.changed || std::abs(trust - pixel->trust) > noticeable_trust;
    pixel->trust = trust;
    if (d < edge_px) result.lost_edge += (1 - trust) / edge;
  }
  return result;
}

}  // namespace drape
