// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/residuals.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/statistics/sample.hpp"

namespace drape::detect {

namespace {

/// Sum of a[i] * b[i] in a fixed order; `count` is a multiple of `lanes`.
DRAPE_WIDE_VECTORS float lane_dot(const float* a, const float* b, int count) {
  return lane_sum(a, b, count);
}

/// A grid of pixels stored row by row in one plane.
struct GridRows {
  int stride = 0;  ///< distance between rows
  int count = 0;   ///< number of values written; a multiple of `lanes`
};

/// Sums over each pixel's neighbours at squared distances 0, 1, 2, 4, 5, 8, 9, 10, 13 and 18, times
/// `used` there. The planes must extend three rows and three pixels beyond `count`.
DRAPE_WIDE_VECTORS void neighbour_sums(const float* plane, const float* used, const GridRows& grid,
                                       const std::array<float*, 10>& sums) {
  const int one = grid.stride, two = 2 * one, three = 3 * one;
  const float* const __restrict here = used;
  const float* const __restrict from = plane;
  const std::array<float*, 10> to = sums;
#pragma GCC ivdep
  for (int i = 0; i < grid.count; ++i) {
    const float* const p = from + i;
    // Pixels one, two and three rows above and below, and one, two and three columns beside those.
    const float up1 = p[-one] + p[one], up2 = p[-two] + p[two], up3 = p[-three] + p[three];
    const float side1 = p[-1] + p[1], side2 = p[-2] + p[2], side3 = p[-3] + p[3];
    const auto at = [&](int down, int right) __attribute__((always_inline)) {
      const int y = down * one;
      return (p[-y - right] + p[-y + right]) + (p[y - right] + p[y + right]);
    };
    to[0][i] = here[i] * p[0];
    to[1][i] = here[i] * (side1 + up1);
    to[2][i] = here[i] * at(1, 1);
    to[3][i] = here[i] * (side2 + up2);
    to[4][i] = here[i] * (at(1, 2) + at(2, 1));
    to[5][i] = here[i] * at(2, 2);
    to[6][i] = here[i] * (side3 + up3);
    to[7][i] = here[i] * (at(1, 3) + at(3, 1));
    to[8][i] = here[i] * (at(2, 3) + at(3, 2));
    to[9][i] = here[i] * at(3, 3);
  }
}

/// Four planes of one grid, and the positions of the lanes in which one of them is non-zero.
struct FourPlanes {
  std::array<const float*, 4> planes;
  const int* places = nullptr;
  int count = 0;
};

/// Sums, for each plane, products of its values with those `offset` further on, in order of
/// position.
DRAPE_WIDE_VECTORS void offset_products(const FourPlanes& of, int offset,
                                        std::array<float, 4>& sums) {
  const FourPlanes all = of;
  Lane sum[4] = {};
  for (int n = 0; n < all.count; ++n) {
    const int place = all.places[n];
    for (int k = 0; k < 4; ++k) {
      Lane u, v;
      std::memcpy(&u, all.planes[k] + place, sizeof u);
      std::memcpy(&v, all.planes[k] + place + offset, sizeof v);
      sum[k] += u * v;
    }
  }
  for (int k = 0; k < 4; ++k) sums[k] = total(sum[k]);
}

using Model = BlurredEllipse;
using Plane = std::vector<float>;

constexpr int reach = 3;
constexpr int light_planes = 3;  // constant and gradient of the light
static_assert(Model::light == 0 && Model::light_x == 1 && Model::light_y == 2);
constexpr float least_trust = 0.5F;
constexpr float whole_light = 0.999F;
constexpr double least_ring_pixels = 24;

/// Residuals and sensitivities of part of the patch on its pixel grid, zero elsewhere, padded so
/// that a neighbour is at a fixed offset.
struct Grid {
  int stride = 0, first = 0, count = 0;
  Plane residual, used;
  Plane u, v, light;  ///< near the outline
  std::array<Plane, light_planes>
      basis;  ///< in the ring: orthonormal basis of what the fit absorbs

  explicit Grid(const Patch& patch) : stride(2 * (patch.reach_x + reach) + 1) {
    const int height = 2 * patch.reach_y + 1;
    first = reach * stride + reach;
    count = (height * stride + lanes - 1) / lanes * lanes;
  }
  void room(Plane& plane) const { plane.assign(count + 2 * static_cast<std::size_t>(first), 0.0F); }
  /// Sum over pixel pairs that are `offset` apart.
  [[nodiscard]] double pairs(const Plane& a, const Plane& b, int offset) const {
    return lane_dot(a.data() + first, b.data() + first + offset, count);
  }
  [[nodiscard]] double dot(const Plane& a, const Plane& b) const { return pairs(a, b, 0); }
};

/// Visits the pixels with their block of the model and their influence on the centre.
template <class Visit>
void each_pixel(const FittedPatch& fit, const Grid& grid, const Visit& visit) {
  const Eigen::Matrix<float, 2, Model::size> rows =
      fit.covariance.middleRows<2>(Model::cx).cast<float>();
  PixelBlock block;
  Influence influence;
  const PixelColumns& pixels = fit.pixels;
  for (int from = 0; from < pixels.size(); from += PixelBlock::size) {
    const int count = std::min(PixelBlock::size, pixels.size() - from);
    pixels.evaluate(from, count, fit.model, fit.noise, block);
    influence_of(block, count, rows, influence);
    for (int i = 0; i < count; ++i) {
      if (pixels.trust(from + i) < least_trust) continue;
      const int at = grid.first + (pixels.y(from + i) + fit.patch.reach_y) * grid.stride +
                     pixels.x(from + i) + fit.patch.reach_x;
      visit(block, influence, i, at);
    }
  }
}

Grid edge_grid(const FittedPatch& fit) {
  Grid grid(fit.patch);
  for (Plane* plane : {&grid.residual, &grid.used, &grid.u, &grid.v, &grid.light})
    grid.room(*plane);
  const auto bright_sigma = static_cast<float>(fit.noise.sigma(fit.model.light_at_centre()));
  each_pixel(fit, grid, [&](const PixelBlock& block, const Influence& influence, int i, int at) {
    if (block.edge[i] == 0) return;
    const float per_sigma = influence.per_sigma[i];
    grid.residual[at] = block.residual[i] * per_sigma;
    grid.u[at] = influence.u[i];
    grid.v[at] = influence.v[i];
    grid.light[at] = block.gradient[Model::light][i] * per_sigma * bright_sigma;
    grid.used[at] = 1;
  });
  return grid;
}

/// Far from the outline, only level and gradient of the light affect a pixel, so the fit absorbs a
/// three-dimensional subspace there.
Grid ring_grid(const FittedPatch& fit) {
  Grid grid(fit.patch);
  grid.room(grid.residual);
  grid.room(grid.used);
  for (Plane& plane : grid.basis) grid.room(plane);
  const Eigen::Matrix3d light = fit.covariance.topLeftCorner<light_planes, light_planes>();
  const Eigen::Matrix3d root = Eigen::LLT<Eigen::Matrix3d>(light).matrixL();
  const Eigen::Matrix3f turn = root.transpose().cast<float>();
  each_pixel(fit, grid, [&](const PixelBlock& block, const Influence& influence, int i, int at) {
    if (block.edge[i] != 0 || block.gradient[Model::light][i] < whole_light) return;
    const float per_sigma = influence.per_sigma[i];
    grid.residual[at] = block.residual[i] * per_sigma;
    grid.used[at] = 1;
    const Eigen::Vector3f gradient(block.gradient[Model::light][i],
                                   block.gradient[Model::light_x][i],
                                   block.gradient[Model::light_y][i]);
    const Eigen::Vector3f along = turn * (gradient * per_sigma);
    for (int k = 0; k < light_planes; ++k) grid.basis[k][at] = along(k);
  });
  return grid;
}

using Spread = std::array<Plane, RingResiduals::count>;

/// Sums a plane over neighbours at each of the distances, where the grid is used.
void spread(const Grid& grid, const Plane& plane, Spread& sums) {
  static_assert(RingResiduals::distances == std::array<int, 10>{0, 1, 2, 4, 5, 8, 9, 10, 13,
                                                                18});  // order as in neighbour_sums
  std::array<float*, RingResiduals::count> to;
  for (int k = 0; k < RingResiduals::count; ++k) {
    sums[k].resize(plane.size());
    to[k] = sums[k].data() + grid.first;
  }
  neighbour_sums(plane.data() + grid.first, grid.used.data() + grid.first,
                 {grid.stride, grid.count}, to);
}

/// With residuals r = (I - H) e, H = U U' and D_k the pairs at distance k, the expectation of r'
/// D_k r is the trace of D_k (I - H) D_j (I - H) per unit of correlation at distance j.
RingResiduals ring_residuals(const Grid& grid) {
  constexpr int n = RingResiduals::count;
  using Square = Eigen::Matrix<double, light_planes, light_planes>;
  RingResiduals ring;
  Spread pairs, products, followed;
  spread(grid, grid.used, pairs);
  spread(grid, grid.residual, products);
  std::array<Square, n> inner;
  for (int p = 0; p < light_planes; ++p) {
    spread(grid, grid.basis[p], followed);
    for (int k = 0; k < n; ++k) {
      for (int q = 0; q < light_planes; ++q) inner[k](q, p) = grid.dot(grid.basis[q], followed[k]);
      for (int j = 0; j <= k; ++j) ring.seen(k, j) -= 2 * grid.dot(followed[k], followed[j]);
    }
  }
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j <= k; ++j) {
      ring.seen(k, j) += (inner[k] * inner[j]).trace();
      ring.seen(j, k) = ring.seen(k, j);
    }
    ring.seen(k, k) += grid.dot(grid.used, pairs[k]);
    ring.product(k) = grid.dot(grid.residual, products[k]);
  }
  ring.pixels = grid.dot(grid.used, grid.used);
  return ring;
}

/// Solves for the texture that reproduces the frame's ring residuals. Each dot is scaled by its own
/// variance, so that one beside a shadow does not dominate.
RingResiduals::Sums texture_of(const std::vector<const EdgeResiduals*>& dots) {
  RingResiduals all;
  std::vector<double> variances;
  for (const EdgeResiduals* dot : dots) {
    if (!dot->ring || dot->ring->pixels < least_ring_pixels || dot->ring->product(0) <= 0) continue;
    const double variance = dot->ring->product(0) / dot->ring->pixels;
    variances.push_back(variance);
    all.product += dot->ring->product / variance;
    all.seen += dot->ring->seen;
  }
  if (variances.empty()) return RingResiduals::Sums::Zero();
  RingResiduals::Sums noise = all.seen.partialPivLu().solve(all.product) * median(variances);
  if (!noise.allFinite()) return RingResiduals::Sums::Zero();
  noise(0) -= 1;  // the white noise of the frame
  return noise;
}

}  // namespace

EdgeResiduals edge_residuals(const FittedPatch& fit, bool with_ring) {
  EdgeResiduals edge;
  const Grid grid = edge_grid(fit);
  double weighted = 0, lit = 0;
  std::vector<int> places;
  for (int k = grid.first; k < grid.first + grid.count; k += lanes) {
    bool any = false;
    for (int i = k; i < k + lanes; ++i) {
      if (grid.used[i] == 0) continue;
      any = true;
      const double size = grid.u[i] * grid.u[i] + grid.v[i] * grid.v[i];
      weighted += size * grid.residual[i] * grid.residual[i];
      lit += size * grid.light[i] * grid.light[i];
    }
    if (any) places.push_back(k);
  }
  const FourPlanes planes{{grid.residual.data(), grid.used.data(), grid.u.data(), grid.v.data()},
                          places.data(),
                          static_cast<int>(places.size())};
  for (int dy = 0; dy <= reach; ++dy) {
    for (int dx = dy == 0 ? 0 : -reach; dx <= reach; ++dx) {
      const int distance = dx * dx + dy * dy;
      const double twice = distance == 0 ? 1 : 2;  // each pair counts from both ends
      std::array<float, 4> sums;
      offset_products(planes, dy * grid.stride + dx, sums);
      edge.product[distance] += twice * sums[0];
      edge.pairs[distance] += twice * sums[1];
      edge.influence[distance] += twice * (static_cast<double>(sums[2]) + sums[3]);
    }
  }
  if (edge.influence[0] > 0) {
    edge.chi2 = weighted / edge.influence[0];
    edge.light = lit / edge.influence[0];
  }
  if (with_ring) edge.ring = ring_residuals(ring_grid(fit));
  return edge;
}

Correlation correlation_of(const std::vector<const EdgeResiduals*>& dots) {
  constexpr int classes = EdgeResiduals::classes;
  std::array<double, classes> product = {}, pairs = {};
  for (const EdgeResiduals* dot : dots) {
    if (dot->product[0] <= 0) continue;
    // Each dot is scaled by its own variance, so that one bad fit does not dominate the frame.
    const double variance = dot->product[0] / dot->pairs[0];
    for (int k = 0; k < classes; ++k) {
      product[k] += dot->product[k] / variance;
      pairs[k] += dot->pairs[k];
    }
  }
  Correlation correlation;
  for (int k = 0; k < classes; ++k) {
    if (pairs[k] > 0) correlation.at[k] = product[k] / pairs[k];
  }
  correlation.texture = texture_of(dots);
  return correlation;
}

double excess_of(const EdgeResiduals& dot, const Correlation& correlation) {
  if (dot.influence[0] <= 0) return 1;
  double outline = 1, ring = 1;
  for (int k = 1; k < EdgeResiduals::classes; ++k) {
    outline += correlation.at[k] * dot.influence[k] / dot.influence[0];
  }
  for (int k = 0; k < RingResiduals::count; ++k) {
    ring += dot.light * correlation.texture(k) * dot.influence[RingResiduals::distances[k]] /
            dot.influence[0];
  }
  // The result is never below the frame's own noise.
  return std::max(std::max(1.0, outline) * std::max(1.0, dot.chi2), ring);
}

}  // namespace drape::detect
