// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.hpp"
#include "core/numbers/order.hpp"

namespace drape::capture {
namespace {

constexpr int kIterations = 25;
constexpr double kConverged_px = 1e-3;
constexpr double kTextureOfNoise = 4.0;  ///< gradient energy below that of this noise is no texture

struct Plane {
  int width = 0, height = 0;
  std::vector<float> values;
  [[nodiscard]] float at(int x, int y) const {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  /// Between pixels, linear in both directions.
  [[nodiscard]] double between(double x, double y) const {
    const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
    const double u = x - column, v = y - row;
    return (1 - v) * ((1 - u) * at(column, row) + u * at(column + 1, row)) +
           v * ((1 - u) * at(column, row + 1) + u * at(column + 1, row + 1));
  }
};

/// Means of squares of `factor` x `factor` pixels.
Plane shrunk(const GreyView& view, int factor) {
  Plane plane{view.width_px / factor, view.height_px / factor, {}};
  plane.values.reserve(static_cast<std::size_t>(plane.width) *
                       static_cast<std::size_t>(plane.height));
  for (int y = 0; y < plane.height; ++y)
    for (int x = 0; x < plane.width; ++x) {
      int sum = 0;
      for (int j = 0; j < factor; ++j)
        for (int i = 0; i < factor; ++i)
          sum += view.pixels[static_cast<std::size_t>(y * factor + j) *
                                 static_cast<std::size_t>(view.width_px) +
                             static_cast<std::size_t>(x * factor + i)];
      plane.values.push_back(static_cast<float>(sum) / static_cast<float>(factor * factor));
    }
  return plane;
}

/// Sums over a block: gradients of the first picture, and how it differs from the second one.
struct Block {
  int x0, y0, side;
};

struct Normal {
  double xx = 0, xy = 0, yy = 0;  ///< of the gradients about their mean
  double mean_x = 0, mean_y = 0, mean = 0, variance = 0;
  [[nodiscard]] double smallest() const { return 0.5 * (xx + yy - std::hypot(xx - yy, 2 * xy)); }
};

double slope_x(const Plane& p, int x, int y) {
  return 0.5 * (p.at(x + 1, y) - p.at(x - 1, y));
}
double slope_y(const Plane& p, int x, int y) {
  return 0.5 * (p.at(x, y + 1) - p.at(x, y - 1));
}

Normal normal_of(const Plane& a, const Block& b) {
  Normal n;
  const double count = static_cast<double>(b.side) * b.side;
  for (int y = b.y0; y < b.y0 + b.side; ++y)
    for (int x = b.x0; x < b.x0 + b.side; ++x) {
      const double gx = slope_x(a, x, y), gy = slope_y(a, x, y), value = a.at(x, y);
      n.mean_x += gx / count;
      n.mean_y += gy / count;
      n.mean += value / count;
      n.xx += gx * gx;
      n.xy += gx * gy;
      n.yy += gy * gy;
      n.variance += value * value / count;
    }
  n.xx -= count * n.mean_x * n.mean_x;
  n.xy -= count * n.mean_x * n.mean_y;
  n.yy -= count * n.mean_y * n.mean_y;
  n.variance -= n.mean * n.mean;
  return n;
}

/// Differences of the second picture, read `dx`, `dy` farther, to the first one.
struct Misfit {
  double x = 0, y = 0;        ///< gradient-weighted, about the means
  double variance = 0;        ///< of the difference
  double other_variance = 0;  ///< of the second picture itself
};

Misfit misfit_of(const Plane& a, const Plane& b, const Block& block, const Normal& n, double dx,
                 double dy) {
  Misfit m;
  double sum = 0, other = 0;
  const double count = static_cast<double>(block.side) * block.side;
  for (int y = block.y0; y < block.y0 + block.side; ++y)
    for (int x = block.x0; x < block.x0 + block.side; ++x) {
      const double value = b.between(x + dx, y + dy), e = value - a.at(x, y);
      sum += e / count;
      other += value / count;
      m.x += (slope_x(a, x, y) - n.mean_x) * e;
      m.y += (slope_y(a, x, y) - n.mean_y) * e;
      m.variance += e * e / count;
      m.other_variance += value * value / count;
    }
  m.variance = std::max(0.0, m.variance - sum * sum);
  m.other_variance = std::max(0.0, m.other_variance - other * other);
  return m;
}

bool inside(const Plane& p, const Block& b, double dx, double dy) {
  return b.x0 + dx >= 0 && b.y0 + dy >= 0 && b.x0 + b.side + dx < p.width - 1 &&
         b.y0 + b.side + dy < p.height - 1;
}

/// The block's motion in px of the planes; nothing when it is lost.
std::optional<BlockMotion> follow(const Plane& a, const Plane& b, const Block& block,
                                  const Normal& n, const MotionOptions& options) {
  BlockMotion motion;
  const double determinant = n.xx * n.yy - n.xy * n.xy;
  Misfit m;
  for (int i = 0; i < kIterations; ++i) {
    if (!inside(b, block, motion.dx_px, motion.dy_px)) return std::nullopt;
    m = misfit_of(a, b, block, n, motion.dx_px, motion.dy_px);
    const double step_x = -(n.yy * m.x - n.xy * m.y) / determinant;
    const double step_y = -(n.xx * m.y - n.xy * m.x) / determinant;
    motion.dx_px += step_x;
    motion.dy_px += step_y;
    if (std::hypot(motion.dx_px, motion.dy_px) > options.largest_px) return std::nullopt;
    if (std::hypot(step_x, step_y) > kConverged_px) continue;
    // Variances instead of the product's sum: var(b - a) = var(a) + var(b) - 2 cov(a, b).
    const double covariance = 0.5 * (n.variance + m.other_variance - m.variance);
    const double correlation = covariance / std::sqrt(n.variance * m.other_variance + 1e-12);
    if (correlation < options.least_correlation) return std::nullopt;
    motion.sd_px = std::sqrt(m.variance / n.smallest());
    return motion;
  }
  return std::nullopt;
}

}  // namespace

void MotionOptions::check() const {
  if (block_px < 8 || shrink < 1 || block_px / shrink < 8)
    throw usage_error("the blocks are too small to be followed", "give 8 px or more");
  if (!(largest_px > 0) || !(largest_sd_px > 0))
    throw usage_error("a limit of the motion is not positive", "give some px");
}

double MotionResult::largest_px() const {
  double largest = 0;
  for (const BlockMotion& b : blocks)
    largest = std::max(largest, std::hypot(b.dx_px, b.dy_px) - 3 * b.sd_px);
  return largest;
}

MotionResult block_motion(const GreyView& from, const GreyView& to, const MotionOptions& options) {
  options.check();
  if (from.width_px != to.width_px || from.height_px != to.height_px)
    throw usage_error("the pictures differ in size", "compare frames of one camera");
  const Plane a = shrunk(from, options.shrink), b = shrunk(to, options.shrink);
  const int side = options.block_px / options.shrink;
  const auto scale = static_cast<double>(options.shrink);
  MotionResult result;
  for (int y0 = 1; y0 + side + 1 < a.height; y0 += side)
    for (int x0 = 1; x0 + side + 1 < a.width; x0 += side) {
      const Block block{x0, y0, side};
      const Normal n = normal_of(a, block);
      // Noise alone gives half its variance per px to each gradient.
      const double noise = kTextureOfNoise / (scale * scale);
      if (n.smallest() < 0.5 * noise * side * side) continue;
      ++result.textured;
      auto motion = follow(a, b, block, n, options);
      if (!motion) ++result.lost;
      if (!motion || motion->sd_px * scale > options.largest_sd_px) continue;
      result.blocks.push_back({scale * (x0 + 0.5 * side), scale * (y0 + 0.5 * side),
                               scale * motion->dx_px, scale * motion->dy_px,
                               scale * motion->sd_px});
    }
  return result;
}

std::optional<double> background_shift_px(const GreyView& reference, const GreyView& now,
                                          std::size_t least_blocks) {
  MotionOptions options;
  options.shrink = 4;
  options.block_px = 96;
  options.largest_sd_px = 0.3;
  const MotionResult motion = block_motion(reference, now, options);
  std::array<std::vector<double>, 4> x, y;
  for (const BlockMotion& b : motion.blocks) {
    const std::size_t quarter =
        (b.x_px > 0.5 * now.width_px ? 1U : 0U) + (b.y_px > 0.5 * now.height_px ? 2U : 0U);
    x[quarter].push_back(b.dx_px);
    y[quarter].push_back(b.dy_px);
  }
  std::optional<double> largest;
  for (std::size_t q = 0; q < 4; ++q) {
    if (x[q].size() < least_blocks) continue;
    largest = std::max(largest.value_or(0), std::hypot(median(x[q]), median(y[q])));
  }
  return largest;
}

}  // namespace drape::capture
