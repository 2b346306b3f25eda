// SPDX-License-Identifier: Apache-2.0
#include "simulate/cloth/drape_coefficient.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/geometry/vectors.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;

constexpr double kPixel_m = 0.25e-3;
constexpr double kMostPixels = 4e7;  // pixels of the picture; a larger sheet gets coarser ones
constexpr double kUpright = 1e-9;

Vector2d seen(const Field& x, int i) {
  return {x[i], x[x.size() / 3 + i]};
}

/// Squares whose middle is covered.
class Picture {
 public:
  Picture(const Eigen::AlignedBox2d& frame, double pixel_m)
      : low_(frame.min()),
        pixel_(std::max(pixel_m, std::sqrt(frame.volume() / kMostPixels))),
        width_(static_cast<int>(frame.sizes().x() / pixel_) + 1),
        height_(static_cast<int>(frame.sizes().y() / pixel_) + 1),
        covered_(static_cast<std::size_t>(width_) * height_, false) {}

  void add(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    const Vector2d least = a.cwiseMin(b).cwiseMin(c), most = a.cwiseMax(b).cwiseMax(c);
    const double turn = cross(b - a, c - a) < 0 ? -1 : 1;
    for (int v = std::max(0, index(least.y(), 1)); v <= index(most.y(), 1) && v < height_; ++v) {
      for (int u = std::max(0, index(least.x(), 0)); u <= index(most.x(), 0) && u < width_; ++u) {
        const Vector2d p = low_ + pixel_ * Vector2d(u + 0.5, v + 0.5);
        if (turn * cross(b - a, p - a) >= 0 && turn * cross(c - b, p - b) >= 0 &&
            turn * cross(a - c, p - c) >= 0)
          covered_[static_cast<std::size_t>(v) * width_ + u] = true;
      }
    }
  }
  [[nodiscard]] double area() const {
    return pixel_ * pixel_ *
           static_cast<double>(std::count(covered_.begin(), covered_.end(), true));
  }

 private:
  [[nodiscard]] int index(double value, int axis) const {
    return static_cast<int>((value - low_[axis]) / pixel_);
  }
  Vector2d low_;
  double pixel_;
  int width_, height_;
  std::vector<bool> covered_;
};

}  // namespace

double shadow_area_m2(const GridSpec& grid, const Field& position, double pixel_m) {
  Eigen::AlignedBox2d frame;
  for (int i = 0; i < grid.count(); ++i) {
    if (grid.cells_at(i / grid.cols, i % grid.cols) == 0) continue;
    if (!seen(position, i).allFinite()) return 0;
    frame.extend(seen(position, i));
  }
  Picture picture(frame, pixel_m);
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.cols; ++c) {
      if (!grid.has_cell(r, c)) continue;
      const int i = grid.index(r, c);
      const Vector2d b = seen(position, i + 1), d = seen(position, i + grid.cols);
      picture.add(seen(position, i), b, d);
      picture.add(b, seen(position, i + grid.cols + 1), d);
    }
  }
  return picture.area();
}

std::optional<double> drape_coefficient(const GridSpec& grid, const Field& position,
                                        const Scene& scene) {
  if (!grid.round || scene.obstacles.size() != 1) return std::nullopt;
  const auto* disc = std::get_if<Cylinder>(&scene.obstacles.front());
  if (disc == nullptr) return std::nullopt;
  if (std::abs(std::abs(disc->world_from_cylinder.rotation(2, 2)) - 1) > kUpright)
    return std::nullopt;
  int cells = 0;
  for (int i = 0; i < grid.count(); ++i) cells += grid.has_cell(i / grid.cols, i % grid.cols);
  const double specimen = cells * grid.warp_spacing_m() * grid.weft_spacing_m();
  const double below = std::numbers::pi * disc->radius_m * disc->radius_m;
  if (specimen <= below) return std::nullopt;
  return (shadow_area_m2(grid, position, kPixel_m) - below) / (specimen - below);
}

}  // namespace drape::simulate
