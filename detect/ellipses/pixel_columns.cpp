// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/ellipse_fit.hpp"

#include <cmath>
#include <utility>

#include "core/statistics/sample.hpp"

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

  /// Eighth of the dot that a pixel lies in.
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

using Model = BlurredEllipse;
constexpr float far_in_blurs = 3.5F;
constexpr auto shallowest = static_cast<float>(Model::shallowest);
constexpr float outline_px = 1.5F;      // width of the band along the outline, for lost fractions
constexpr float stranger_px = 0.3F;     // outliers are searched from this distance outwards
constexpr double biweight_limit = 6.0;  // in scales of the residuals
constexpr double gross_misfit = 0.15;   // fraction of the contrast
constexpr double noticeable_trust = 0.05;

/// exp(-z^2 / 2) / sqrt(2 pi) for |z| <= 3.5, within 2e-6: Taylor series at z^2 / 16, power 8.
inline float density(float z) {
  const float u = -z * z * (0.5F / 8);
  float e = 1 + u * (1.0F / 8);
  e = 1 + u * (1.0F / 7) * e;
  e = 1 + u * (1.0F / 6) * e;
  e = 1 + u * (1.0F / 5) * e;
  e = 1 + u * (1.0F / 4) * e;
  e = 1 + u * (1.0F / 3) * e;
  e = 1 + u * (1.0F / 2) * e;
  e = 1 + u * e;
  e *= e;
  e *= e;
  e *= e;
  return 0.39894228F * e;
}

/// Upper tail of the normal distribution at |z| (Abramowitz & Stegun 1964, 26.2.17; 7.5e-8).
inline float tail(float distance, float at_density) {
  const float t = 1 / (1 + 0.2316419F * distance);
  return at_density * t *
         (0.319381530F +
          t * (-0.356563782F + t * (1.781477937F + t * (-1.821255978F + t * 1.330274429F))));
}

/// Parameters of the model, in its order, and its deepest distance.
struct Shape {
  float light, light_x, light_y, print, cx, cy, m11, m12, m22, blur, deepest;
};

Shape shape_of(const Model& model) {
  const Eigen::Matrix<float, Model::size, 1> p = model.parameters().cast<float>();
  Shape s{p(0), p(1), p(2), p(3), p(4), p(5), p(6), p(7), p(8), p(9), 0};
  const float norm = std::sqrt(s.m11 * s.m11 + 2 * s.m12 * s.m12 + s.m22 * s.m22);
  s.deepest = -(1 - shallowest) / std::max(norm, 1e-9F);
  return s;
}

/// Pointers to the columns of pixels.
struct Pixels {
  const float *x, *y, *level, *trust;
};

DRAPE_WIDE_VECTORS void evaluate_block(const Pixels& p, int count, const Shape& shape,
                                       const NoiseModel& noise, PixelBlock& block) {
  // Local copies, which the stores below cannot alias.
  const Shape s = shape;
  const float* const __restrict x = p.x;
  const float* const __restrict y = p.y;
  const float* const __restrict level = p.level;
  const float* const __restrict trust = p.trust;
  const auto floor_variance = static_cast<float>(noise.floor_variance);
  const auto slope = static_cast<float>(noise.slope);
  const float per_blur = 1 / s.blur;
  auto& g = block.gradient;
  for (int i = 0; i < count; ++i) {
    const float ux = x[i] - s.cx, uy = y[i] - s.cy;
    const float vx = s.m11 * ux + s.m12 * uy, vy = s.m12 * ux + s.m22 * uy;
    const float wx = s.m11 * vx + s.m12 * vy, wy = s.m12 * vx + s.m22 * vy;
    const float per_norm = 1 / std::max(std::sqrt(wx * wx + wy * wy), 1e-9F);
    const float rho = std::sqrt(vx * vx + vy * vy);
    const float d = rho < shallowest ? s.deepest : (rho - 1) * rho * per_norm;
    const float z = d * per_blur;
    const float out = std::abs(z);
    const float near = out < far_in_blurs ? 1.0F : 0.0F;
    const float peak = near * density(std::min(out, far_in_blurs));
    const float beyond = tail(std::min(out, far_in_blurs), peak);
    const float covered = z < 0 ? 1 - beyond : beyond;
    const float base = s.light + s.light_x * x[i] + s.light_y * y[i];
    const float through = 1 - s.print * covered;
    const float by_distance = base * s.print * peak * per_blur;
    const float fraction = by_distance * per_norm;
    const float expected = base * through;
    g[Model::light][i] = through;
    g[Model::light_x][i] = x[i] * through;
    g[Model::light_y][i] = y[i] * through;
    g[Model::print][i] = -base * covered;
    g[Model::cx][i] = -fraction * wx;
    g[Model::cy][i] = -fraction * wy;
    g[Model::m11][i] = fraction * vx * ux;
    g[Model::m12][i] = fraction * (vx * uy + vy * ux);
    g[Model::m22][i] = fraction * vy * uy;
    g[Model::blur][i] = -by_distance * z;
    block.residual[i] = level[i] - expected;
    const float precision =
        1 / (floor_variance + slope * std::min(std::max(expected, 0.0F), 255.0F));
    block.precision[i] = precision;
    block.weight[i] = trust[i] * precision;
    block.edge[i] = near;
    block.distance[i] = d;
  }
}

/// Sums of products of one column with `width` others, each as in lane_sum.
template <int width>
inline __attribute__((always_inline)) void lane_sums(const float* a,
                                                     const float (*b)[PixelBlock::size], int count,
                                                     double* to, int step) {
  Lane sum[width] = {};
  for (int i = 0; i < count; i += lanes) {
    Lane u;
    std::memcpy(&u, a + i, sizeof u);
    for (int k = 0; k < width; ++k) {
      Lane v;
      std::memcpy(&v, b[k] + i, sizeof v);
      sum[k] += u * v;
    }
  }
  for (int k = 0; k < width; ++k) to[k * step] += total(sum[k]);
}

DRAPE_WIDE_VECTORS void add_block(const PixelBlock& block, int count, Normal& normal) {
  alignas(32) float weighted[PixelBlock::size];
  constexpr int step = Model::size;  // distance between columns of the matrix
  for (int row = 0; row < Model::size; ++row) {
    for (int i = 0; i < count; ++i) weighted[i] = block.weight[i] * block.gradient[row][i];
    normal.gradient(row) += lane_sum(weighted, block.residual, count);
    double* const to = &normal.hessian(row, 0);
    int col = 0;
    for (; col + 5 <= row + 1; col += 5) {
      lane_sums<5>(weighted, block.gradient + col, count, to + col * step, step);
    }
    for (; col + 2 <= row + 1; col += 2) {
      lane_sums<2>(weighted, block.gradient + col, count, to + col * step, step);
    }
    if (col <= row) lane_sums<1>(weighted, block.gradient + col, count, to + col * step, step);
  }
  for (int i = 0; i < count; ++i) weighted[i] = block.weight[i] * block.residual[i];
  normal.chi2 += lane_sum(weighted, block.residual, count);
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

DRAPE_WIDE_VECTORS void influence_of(const PixelBlock& block, int count,
                                     const Eigen::Matrix<float, 2, Model::size>& rows,
                                     Influence& influence) {
  float* const __restrict per_sigma = influence.per_sigma;
  float* const __restrict u = influence.u;
  float* const __restrict v = influence.v;
  for (int i = 0; i < count; ++i) {
    per_sigma[i] = std::sqrt(block.precision[i]);
    u[i] = v[i] = 0;
  }
  for (int k = 0; k < Model::size; ++k) {
    const float to_u = rows(0, k), to_v = rows(1, k);
    const float* const __restrict gradient = block.gradient[k];
    for (int i = 0; i < count; ++i) {
      u[i] += to_u * gradient[i];
      v[i] += to_v * gradient[i];
    }
  }
  for (int i = 0; i < count; ++i) {
    u[i] *= per_sigma[i];
    v[i] *= per_sigma[i];
  }
}

PixelColumns::PixelColumns(const Patch& patch) {
  for (const PatchPixel& pixel : patch.pixels) ++count_[pixel.sector];
  for (int k = 0; k < 8; ++k) {
    begin_[k + 1] = begin_[k] + (count_[k] + lanes - 1) / lanes * lanes;
  }
  for (std::vector<float>* column : {&x_, &y_, &level_, &trust_}) column->resize(begin_[8], 0.0F);
  std::array<int, 9> next = begin_;
  for (const PatchPixel& pixel : patch.pixels) {
    const int at = next[pixel.sector]++;
    x_[at] = static_cast<float>(pixel.x);
    y_[at] = static_cast<float>(pixel.y);
    level_[at] = static_cast<float>(pixel.level);
    trust_[at] = static_cast<float>(pixel.trust);
  }
}

void PixelColumns::evaluate(int first, int count, const Model& model, const NoiseModel& noise,
                            PixelBlock& block) const {
  evaluate_block(
      {x_.data() + first, y_.data() + first, level_.data() + first, trust_.data() + first}, count,
      shape_of(model), noise, block);
}

Normal PixelColumns::sum(int first, int last, const Model& model, const NoiseModel& noise) const {
  Normal normal;
  PixelBlock block;
  for (int from = first; from < last; from += PixelBlock::size) {
    const int count = std::min(PixelBlock::size, last - from);
    evaluate(from, count, model, noise, block);
    add_block(block, count, normal);
  }
  for (int row = 0; row < Model::size; ++row) {
    for (int col = 0; col < row; ++col) normal.hessian(col, row) = normal.hessian(row, col);
  }
  return normal;
}

Normal PixelColumns::sum(const Model& model, const NoiseModel& noise) const {
  return sum(0, size(), model, noise);
}

std::array<Normal, 8> PixelColumns::sum_sectors(const Model& model, const NoiseModel& noise) const {
  std::array<Normal, 8> sectors;
  for (int k = 0; k < 8; ++k) sectors[k] = sum(begin_[k], begin_[k + 1], model, noise);
  return sectors;
}

double PixelColumns::total_trust() const {
  double sum = 0;
  for (const float trust : trust_) sum += trust;
  return sum;
}

template <class Visit>
void PixelColumns::each(const Model& model, const NoiseModel& noise, const Visit& visit) const {
  PixelBlock block;
  for (int k = 0; k < 8; ++k) {
    const int end = begin_[k] + count_[k];
    for (int from = begin_[k]; from < end; from += PixelBlock::size) {
      evaluate(from, std::min(PixelBlock::size, begin_[k + 1] - from), model, noise, block);
      for (int i = 0; i < std::min(PixelBlock::size, end - from); ++i) visit(from + i, block, i);
    }
  }
}

Strangers PixelColumns::distrust_strangers(const Model& fitted, const NoiseModel& noise) {
  struct Outside {
    float residual, distance;
    int index;
  };
  std::vector<Outside> outside;
  std::vector<float> sizes;
  double edge = 0;
  each(fitted, noise, [&](int index, const PixelBlock& block, int i) {
    const float d = block.distance[i];
    edge += std::abs(d) < outline_px;
    if (d < stranger_px) return;
    outside.push_back({block.residual[i], d, index});
    sizes.push_back(std::abs(block.residual[i]));
  });
  Strangers result;
  if (sizes.empty() || edge == 0) return result;
  const double bright = fitted.light_at_centre();
  const double scale = std::max(noise.sigma(bright), median(std::move(sizes)) / 0.6745);
  const double limit =
      std::max(biweight_limit * scale, gross_misfit * bright * fitted.parameters()(Model::print));
  for (const auto& [residual, d, index] : outside) {
    // Flat up to half the limit: normal pixels keep their full weight and iteration ends early.
    const double beyond = std::max(0.0, 2 * std::abs(residual) / limit - 1);
    const double keep = std::max(0.0, 1 - beyond * beyond);
    const double trust = keep * keep;
    result.changed = result.changed || std::abs(trust - trust_[index]) > noticeable_trust;
    trust_[index] = static_cast<float>(trust);
    if (d < outline_px) result.lost_edge += (1 - trust) / edge;
  }
  return result;
}

}  // namespace drape::detect
