// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/error.hpp"
#include "core/statistics/sample.hpp"

namespace drape::capture {
namespace following {

struct Plane {
  int width = 0, height = 0;
  std::vector<float> values;
  [[nodiscard]] float at(int x, int y) const {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  [[nodiscard]] const float* row(int y) const {
    return values.data() + static_cast<std::ptrdiff_t>(y) * width;
  }
};

struct Block {
  int x0, y0, side;
};

/// Sums over one block of the first picture.
struct Normal {
  double xx = 0, xy = 0, yy = 0;  ///< sums of products of gradients about their mean
  double mean_x = 0, mean_y = 0, mean = 0, variance = 0;
  [[nodiscard]] double smallest() const { return 0.5 * (xx + yy - std::hypot(xx - yy, 2 * xy)); }
  [[nodiscard]] double largest() const { return 0.5 * (xx + yy + std::hypot(xx - yy, 2 * xy)); }
  /// Direction of the dominant gradient, from +x.
  [[nodiscard]] double angle_rad() const { return 0.5 * std::atan2(2 * xy, xx - yy); }
};

}  // namespace following

namespace {

using following::Block, following::Normal, following::Plane;

constexpr int kIterations = 25;
constexpr double kConverged_px = 1e-3;
constexpr double kTextureOfNoise = 4.0;  ///< multiple of the noise's gradients that texture exceeds
constexpr double kOverNoise = 1.5;       ///< and more than this multiple of the block's own noise

/// Noise of variance n in the difference of two pictures lowers the correlation of a block of
/// variance v to 1 - n / (2 v): to 0.7 for v = 1.7 n, to 0.94 for v = 8 n.
constexpr double kHiddenByNoise = 8.0;

/// Variance of rounding a grey level.
constexpr double kOfRounding = 1.0 / 12;

/// Averages squares of `factor` x `factor` pixels.
Plane shrunk(const GreyView& view, int factor) {
  Plane plane{view.width_px / factor, view.height_px / factor, {}};
  if (factor == 1) {
    plane.values.assign(view.pixels.begin(), view.pixels.end());
    return plane;
  }
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

/// Second differences, blind to slopes and, by the median, to edges (Immerkaer 1996).
double noise_variance(const Plane& a, const Block& b) {
  std::vector<double> differences;
  for (int y = b.y0; y < b.y0 + b.side; ++y)
    for (int x = b.x0; x < b.x0 + b.side; ++x)
      differences.push_back(
          std::abs(a.at(x - 1, y - 1) + a.at(x + 1, y - 1) + a.at(x - 1, y + 1) +
                   a.at(x + 1, y + 1) + 4 * a.at(x, y) -
                   2 * (a.at(x, y - 1) + a.at(x, y + 1) + a.at(x - 1, y) + a.at(x + 1, y))));
  // The filter amplifies the variance 36 times; a median is 0.6745 standard deviations.
  const double sd = median(std::move(differences)) / (6 * 0.6745);
  return sd * sd;
}

/// Difference between the second picture, shifted by `dx`, `dy`, and the first.
struct Misfit {
  double x = 0, y = 0;        ///< weighted by the gradient, about the means
  double variance = 0;        ///< variance of the difference
  double other_variance = 0;  ///< variance of the second picture
};

Misfit misfit_of(const Plane& a, const Plane& b, const Block& block, const Normal& n, double dx,
                 double dy) {
  Misfit m;
  double sum = 0, other = 0;
  const double count = static_cast<double>(block.side) * block.side;
  // Bilinear interpolation, with the same weights for the whole block.
  const int column = static_cast<int>(std::floor(dx)), row = static_cast<int>(std::floor(dy));
  const double u = dx - column, v = dy - row;
  for (int y = block.y0; y < block.y0 + block.side; ++y) {
    const float *here = a.row(y), *above = a.row(y - 1), *below = a.row(y + 1);
    const float *first = b.row(y + row) + column, *second = b.row(y + row + 1) + column;
    for (int x = block.x0; x < block.x0 + block.side; ++x) {
      const double value = (1 - v) * ((1 - u) * first[x] + u * first[x + 1]) +
                           v * ((1 - u) * second[x] + u * second[x + 1]);
      const double e = value - here[x];
      sum += e;
      other += value;
      m.x += (0.5 * (here[x + 1] - here[x - 1]) - n.mean_x) * e;
      m.y += (0.5 * (below[x] - above[x]) - n.mean_y) * e;
      m.variance += e * e;
      m.other_variance += value * value;
    }
  }
  sum /= count;
  other /= count;
  m.variance /= count;
  m.other_variance /= count;
  m.variance = std::max(0.0, m.variance - sum * sum);
  m.other_variance = std::max(0.0, m.other_variance - other * other);
  return m;
}

bool inside(const Plane& p, const Block& b, double dx, double dy) {
  return b.x0 + dx >= 0 && b.y0 + dy >= 0 && b.x0 + b.side + dx < p.width - 1 &&
         b.y0 + b.side + dy < p.height - 1;
}

/// Directions in which a block is tracked: both, or only across its edges.
enum class Along { both, gradient };

/// Motion of the block in px of the planes; nullopt if it is lost.
std::optional<BlockMotion> follow(const Plane& a, const Plane& b, const Block& block,
                                  const Normal& n, const MotionOptions& options, Along along) {
  BlockMotion motion;
  motion.sd_px = std::numeric_limits<double>::infinity();  // until converged
  const double determinant = n.xx * n.yy - n.xy * n.xy;
  Misfit m;
  for (int i = 0; i < kIterations; ++i) {
    if (!inside(b, block, motion.dx_px, motion.dy_px)) return std::nullopt;
    m = misfit_of(a, b, block, n, motion.dx_px, motion.dy_px);
    double step_x = -(n.yy * m.x - n.xy * m.y) / determinant;
    double step_y = -(n.xx * m.y - n.xy * m.x) / determinant;
    if (along == Along::gradient) {
      const double u = std::cos(n.angle_rad()), v = std::sin(n.angle_rad());
      const double step = -(u * m.x + v * m.y) / n.largest();
      step_x = step * u;
      step_y = step * v;
    }
    motion.dx_px += step_x;
    motion.dy_px += step_y;
    if (std::hypot(motion.dx_px, motion.dy_px) > options.largest_px) return std::nullopt;
    if (std::hypot(step_x, step_y) > kConverged_px) continue;
    motion.sd_px = std::sqrt(m.variance / (along == Along::both ? n.smallest() : n.largest()));
    break;
  }
  motion.residual_variance = m.variance;
  // Covariance from variances: var(b - a) = var(a) + var(b) - 2 cov(a, b).
  const double covariance = 0.5 * (n.variance + m.other_variance - m.variance);
  const double correlation = covariance / std::sqrt(n.variance * m.other_variance + 1e-12);
  if (correlation < options.least_correlation) return std::nullopt;
  return motion;
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

struct BlockFollower::First {
  struct Textured {
    Block block;
    Normal normal;
  };
  MotionOptions options;
  int width_px, height_px;
  Plane plane;
  std::vector<Textured> blocks;
  std::vector<Textured> edges;  ///< blocks with structure in one direction only
};

BlockFollower::BlockFollower(const GreyView& from, const MotionOptions& options) {
  options.check();
  First first{options, from.width_px, from.height_px, shrunk(from, options.shrink), {}, {}};
  const int side = options.block_px / options.shrink;
  const double scale = options.shrink;
  for (int y0 = 1; y0 + side + 1 < first.plane.height; y0 += side)
    for (int x0 = 1; x0 + side + 1 < first.plane.width; x0 += side) {
      const Block block{x0, y0, side};
      const Normal n = normal_of(first.plane, block);
      // Pure noise gives half its variance per px to each gradient.
      const double count = 0.5 * side * side, least = kTextureOfNoise / (scale * scale);
      if (n.largest() / count < least) continue;
      const double noise = noise_variance(first.plane, block);
      const auto is_texture = [&](double energy) {
        return energy / count >= least && energy / count >= kOverNoise * noise;
      };
      if (is_texture(n.smallest()))
        first.blocks.push_back({block, n});
      else if (is_texture(n.largest()))
        first.edges.push_back({block, n});
    }
  first_ = std::make_shared<const First>(std::move(first));
}

int BlockFollower::textured() const {
  return static_cast<int>(first_->blocks.size());
}

int BlockFollower::findable(const GreyView& from) const {
  const MotionOptions& options = first_->options;
  const Plane full = shrunk(from, 1);  // full resolution separates fine texture from noise best
  const int scale = options.shrink;
  return static_cast<int>(std::count_if(
      first_->blocks.begin(), first_->blocks.end(), [&](const First::Textured& textured) {
        const auto& [block, n] = textured;
        const double noise =
            noise_variance(full, {scale * block.x0, scale * block.y0, scale * block.side}) /
            (scale * scale);
        return n.variance - noise >= options.least_correlation * n.variance &&
               scale * std::sqrt(2 * noise / n.smallest()) <= options.largest_sd_px;
      }));
}

bool BlockFollower::has_size_of(const GreyView& other) const {
  return first_->width_px == other.width_px && first_->height_px == other.height_px;
}

MotionResult BlockFollower::motion_to(const GreyView& to) const {
  const MotionOptions& options = first_->options;
  if (!has_size_of(to))
    throw usage_error("the pictures differ in size", "compare frames of one camera");
  const Plane now = shrunk(to, options.shrink);
  const double scale = options.shrink;
  MotionResult result;
  result.textured = textured();
  std::vector<double> noises, levels;  // residual variances and mean grey levels of matched blocks
  std::vector<const Normal*> lost;
  for (const auto& [block, normal] : first_->blocks) {
    const auto motion = follow(first_->plane, now, block, normal, options, Along::both);
    if (!motion) {
      lost.push_back(&normal);
      continue;
    }
    noises.push_back(motion->residual_variance);
    levels.push_back(normal.mean);
    if (motion->sd_px * scale > options.largest_sd_px) continue;
    result.blocks.push_back({scale * (block.x0 + 0.5 * block.side),
                             scale * (block.y0 + 0.5 * block.side), scale * motion->dx_px,
                             scale * motion->dy_px, scale * motion->sd_px,
                             motion->residual_variance});
  }
  result.lost = static_cast<int>(lost.size());
  if (!noises.empty()) {
    // The variance of shot noise grows at most in proportion to the grey level.
    const double hidden = kHiddenByNoise * median(std::move(noises));
    const double level = median(std::move(levels));
    result.gone = static_cast<int>(std::count_if(lost.begin(), lost.end(), [&](const Normal* n) {
      return n->variance > hidden * std::max(1.0, n->mean / level);
    }));
  }
  return result;
}

MotionResult BlockFollower::motion_across_edges_to(const GreyView& to) const {
  const MotionOptions& options = first_->options;
  if (!has_size_of(to))
    throw usage_error("the pictures differ in size", "compare frames of one camera");
  const Plane now = shrunk(to, options.shrink);
  const double scale = options.shrink;
  MotionResult result;
  result.textured = static_cast<int>(first_->edges.size());
  for (const auto& [block, normal] : first_->edges) {
    const auto motion = follow(first_->plane, now, block, normal, options, Along::gradient);
    if (!motion) {
      ++result.lost;
      const double noise = std::max(kOfRounding, noise_variance(first_->plane, block));
      if (normal.variance > kHiddenByNoise * 2 * noise) ++result.gone;
    } else if (motion->sd_px * scale <= options.largest_sd_px) {
      result.blocks.push_back({scale * (block.x0 + 0.5 * block.side),
                               scale * (block.y0 + 0.5 * block.side), scale * motion->dx_px,
                               scale * motion->dy_px, scale * motion->sd_px,
                               motion->residual_variance});
    }
  }
  return result;
}

namespace {

/// Options for the background: averaging 4 x 4 pixels brings faint texture out of noise. Blocks of
/// 24 x 24 such pixels in a large picture, smaller ones in a small picture: about a hundred.
MotionOptions background_options(const GreyView& reference) {
  constexpr int kShrink = 4, kBlocks = 96, kLeastSide = 12, kLargestSide = 24;
  const int cols = reference.width_px / kShrink, rows = reference.height_px / kShrink;
  const double pixels = static_cast<double>(cols) * rows;
  MotionOptions options;
  options.shrink = kShrink;
  options.block_px =
      kShrink * std::clamp(static_cast<int>(std::sqrt(pixels / kBlocks)), kLeastSide, kLargestSide);
  options.largest_sd_px = 0.3;
  return options;
}

}  // namespace

Background::Background(const GreyView& reference)
    : options_(background_options(reference)),
      blocks_(reference, options_),
      findable_(blocks_.findable(reference)) {}

std::optional<double> Background::shift_px(const GreyView& now) const {
  if (!blocks_.has_size_of(now)) return std::nullopt;
  constexpr std::size_t kQuarters = 4;  // and the whole picture
  std::array<std::vector<double>, kQuarters + 1> x, y;
  for (const BlockMotion& b : blocks_.motion_to(now).blocks) {
    const std::size_t quarter =
        (b.x_px > 0.5 * now.width_px ? 1U : 0U) + (b.y_px > 0.5 * now.height_px ? 2U : 0U);
    for (const std::size_t part : {quarter, kQuarters}) {
      x[part].push_back(b.dx_px);
      y[part].push_back(b.dy_px);
    }
  }
  std::optional<double> largest;
  for (std::size_t part = 0; part < x.size(); ++part)
    if (std::ssize(x[part]) >= kLeastBlocks)
      largest = std::max(largest.value_or(0), std::hypot(median(x[part]), median(y[part])));
  return largest;
}

}  // namespace drape::capture
