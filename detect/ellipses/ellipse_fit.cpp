// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/ellipse_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

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

/// A finished fit of a patch.
struct FittedPatch {
  const Patch& patch;
  const PixelColumns& pixels;
  const NoiseModel& noise;
  const BlurredEllipse& model;
  const BlurredEllipse::Matrix& covariance;
};

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
      basis;  ///< in the ring: orthonormal basis of the subspace absorbed by the fit

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
RingResiduals::Sums texture_of(const std::vector<DotFit>& fits) {
  RingResiduals all;
  std::vector<double> variances;
  for (const DotFit& fit : fits) {
    const std::optional<RingResiduals>& ring = fit.edge.ring;
    if (!ring || ring->pixels < least_ring_pixels || ring->product(0) <= 0) continue;
    variances.push_back(ring->product(0) / ring->pixels);
    all.product += ring->product / variances.back();
    all.seen += ring->seen;
  }
  if (variances.empty()) return RingResiduals::Sums::Zero();
  RingResiduals::Sums noise = all.seen.partialPivLu().solve(all.product) * median(variances);
  if (!noise.allFinite()) return RingResiduals::Sums::Zero();
  noise(0) -= 1;  // the white noise of the frame
  return noise;
}

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

using Vector = Model::Vector;
using Matrix = Model::Matrix;

constexpr int most_iterations = 40;
constexpr double converged_px = 1e-3;    // the next Newton step is then well below 0.001 px
constexpr double quick_ratio = 0.2;      // largest ratio of successive step lengths
constexpr double converged_gain = 2e-4;  // decrease of chi-square: a tenth of one pixel's share
constexpr double chi2_scatter = 1e-6;    // rounding of single-precision sums
constexpr double clean_chi2 = 2.5;       // fits below this need no second search for outliers
constexpr int stranger_rounds = 4;
constexpr double most_covered_for_blur = 0.1;

/// Sums the normal equations over the pixels and adds the prior on the blur.
Normal linearise(const PixelColumns& pixels, const NoiseModel& noise, const Model& model,
                 const BlurGuess& guess) {
  Normal normal = pixels.sum(model, noise);
  const double weight = 1 / (guess.sigma_px * guess.sigma_px);
  const double residual = guess.mean_px - model.parameters()(Model::blur);
  normal.hessian(Model::blur, Model::blur) += weight;
  normal.gradient(Model::blur) += weight * residual;
  normal.chi2 += weight * residual * residual;
  return normal;
}

bool acceptable(const Vector& p, const Patch& patch) {
  const Eigen::Matrix2d m = Model(p).outline();
  return p.allFinite() && p(Model::blur) > 0.15 && p(Model::blur) < 6 && p(Model::light) > 0 &&
         p(Model::print) > 0.02 && p(Model::print) < 1.5 && m.trace() > 0 &&
         m.determinant() > 1e-8 && std::abs(p(Model::cx)) < patch.reach_x &&
         std::abs(p(Model::cy)) < patch.reach_y;
}

/// Gauss-Newton with Levenberg damping on the scaled diagonal. If steps shrink quickly, the sums
/// from before the last, tiny step are kept.
bool iterate(const Patch& patch, const PixelColumns& pixels, const NoiseModel& noise,
             const BlurGuess& guess, Vector& p, Normal& normal) {
  double damping = 1e-6, before = 1e9;
  normal = linearise(pixels, noise, Model(p), guess);
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    Matrix damped = normal.hessian;
    damped.diagonal() *= 1 + damping;
    const Vector step = damped.llt().solve(normal.gradient);
    const Vector next = p + step;
    const double gain = step.dot(normal.gradient);
    const double length = step.segment<2>(Model::cx).norm();
    const bool small = length < converged_px, quick = length < quick_ratio * before;
    before = length;
    if (small && quick && gain < converged_gain * normal.chi2 && damping < 1e-3 &&
        acceptable(next, patch)) {
      p = next;
      normal.chi2 -= gain;
      return true;
    }
    if (acceptable(next, patch)) {
      Normal there = linearise(pixels, noise, Model(next), guess);
      if (there.chi2 <= normal.chi2 * (1 + chi2_scatter)) {
        p = next;
        normal = there;
        if (small && damping < 1e-3) return true;
        damping = std::max(damping / 10, 1e-9);
        continue;
      }
      if (small) return true;
    }
    damping = std::max(damping * 20, 1e-3);
    if (damping > 1e6) return false;
  }
  return false;
}

/// Solution of the normal equations for the centre.
struct CentreSolution {
  Eigen::Vector2d step;        ///< change of the centre, px
  Eigen::Matrix2d covariance;  ///< the centre's block of the inverse
};

/// Solves `hessian` x = `gradient` for the centre only: a Cholesky factor that ends with the centre
/// gives both without the other parameters. nullopt if the matrix is not positive definite.
std::optional<CentreSolution> solve_for_centre(const Matrix& hessian, const Vector& gradient) {
  constexpr int n = Model::size;
  static_assert(n == 10 && Model::cx == 4 && Model::cy == 5);
  constexpr std::array<int, n> order = {0, 1, 2, 3, 6, 7, 8, 9, Model::cx, Model::cy};
  // Columns of the lower triangle; row n is the right-hand side, eliminated with the others.
  std::array<std::array<double, n + 1>, n> column;
  for (int k = 0; k < n; ++k) {
    for (int row = k; row < n; ++row) column[k][row] = hessian(order[row], order[k]);
    column[k][n] = gradient(order[k]);
  }
  for (int k = 0; k < n; ++k) {
    if (!(column[k][k] > 0)) return std::nullopt;
    const double per_root = 1 / std::sqrt(column[k][k]);
    for (int row = k; row <= n; ++row) column[k][row] *= per_root;
    for (int next = k + 1; next < n; ++next) {
      const double factor = column[k][next];
      for (int row = next; row <= n; ++row) column[next][row] -= factor * column[k][row];
    }
  }
  Eigen::Matrix2d root = Eigen::Matrix2d::Zero();
  root << column[n - 2][n - 2], 0, column[n - 2][n - 1], column[n - 1][n - 1];
  const Eigen::Matrix2d undo = root.inverse();
  return CentreSolution{undo.transpose() * Eigen::Vector2d(column[n - 2][n], column[n - 1][n]),
                        undo.transpose() * undo};
}

/// Shift of the centre if the pixels of one eighth of the dot are left out. Under white noise its
/// covariance is C_rest - C_all, so a hidden part or a shadow edge stands out.
void check_sectors(const PixelColumns& pixels, const NoiseModel& noise, const Model& model,
                   const Matrix& hessian, DotFit& fit) {
  for (const Normal& sector : pixels.sum_sectors(model, noise)) {
    const auto rest = solve_for_centre(hessian - sector.hessian, sector.gradient);
    if (!rest) continue;
    const Eigen::Matrix2d expected =
        rest->covariance - fit.covariance_px2 + 1e-8 * Eigen::Matrix2d::Identity();
    const double chi2 = rest->step.dot(expected.inverse() * rest->step);
    if (chi2 > fit.one_sided) {
      fit.one_sided = chi2;
      fit.one_sided_px = rest->step.norm();
    }
  }
}

Vector start_parameters(const Blob& blob, const BlurGuess& guess) {
  const Eigen::Matrix2d m =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(blob.shape_px2).operatorInverseSqrt();
  const Eigen::Vector2d offset = blob.centre_px.array() - blob.centre_px.array().round();
  Vector p = Vector::Zero();
  p(Model::light) = blob.bright;
  p(Model::print) = std::clamp(1 - blob.dark / std::max(blob.bright, 1.0), 0.1, 1.0);
  p.segment<2>(Model::cx) = offset;
  p(Model::m11) = m(0, 0);
  p(Model::m12) = m(0, 1);
  p(Model::m22) = m(1, 1);
  p(Model::blur) = guess.mean_px;
  return p;
}

/// Brightness of the core within a fraction of the radius, from print (0) to cloth (1).
std::optional<double> centre_fraction(const GreyImage& image, const Patch& patch,
                                      const Model& model, double within_radii) {
  const Vector& p = model.parameters();
  double sum = 0, most = 1e9, nearest = 0;
  int count = 0;
  for (int y = -patch.reach_y; y <= patch.reach_y; ++y) {
    for (int x = -patch.reach_x; x <= patch.reach_x; ++x) {
      const int u = patch.origin.x() + x, v = patch.origin.y() + y;
      if (u < 0 || v < 0 || u >= image.width_px || v >= image.height_px) continue;
      const double radius = model.radius(x, y);
      const double fraction = 1 - (1 - image.level(u, v) / model.light_at(x, y)) / p(Model::print);
      if (radius < most) {
        most = radius;
        nearest = fraction;
      }
      if (radius > within_radii) continue;
      sum += fraction;
      ++count;
    }
  }
  if (most > 0.5) return std::nullopt;
  return count > 0 ? sum / count : nearest;
}

/// Fits repeatedly while pixels turn out to belong to other objects.
bool settle(const Patch& patch, PixelColumns& pixels, bool dark_ring, const NoiseModel& noise,
            const BlurGuess& guess, Vector& p, Normal& normal, DotFit& fit) {
  if (!iterate(patch, pixels, noise, guess, p, normal)) return false;
  for (int round = 0; round < stranger_rounds; ++round) {
    const bool clean = normal.chi2 <= clean_chi2 * pixels.total_trust();
    if (clean && !(dark_ring && round == 0)) break;
    const Strangers found = pixels.distrust_strangers(Model(p), noise);
    fit.masked_edge = patch.masked_edge + (1 - patch.masked_edge) * found.lost_edge;
    if (!found.changed) break;
    if (!iterate(patch, pixels, noise, guess, p, normal)) return false;
  }
  return true;
}

/// Fraction of the fitted outline outside the image. The initial region ends at the border, so the
/// patch cannot tell how much is missing.
double beyond_border(const GreyImage& image, const DotFit& fit) {
  constexpr int places = 32;
  const Eigen::Matrix2d root =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(fit.shape_px2).operatorSqrt();
  int beyond = 0;
  for (int k = 0; k < places; ++k) {
    const double angle = 2 * std::numbers::pi * k / places;
    const Eigen::Vector2d p =
        fit.centre_px + root * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    beyond += p.x() < 0 || p.y() < 0 || p.x() > image.width_px - 1 || p.y() > image.height_px - 1;
  }
  return static_cast<double>(beyond) / places;
}

/// Outline fit of one dot: its image patch, parameters, normal equations and covariance.
struct Outline {
  DotFit fit;
  Patch patch;
  PixelColumns pixels;
  Vector p;
  Normal normal;
  Matrix covariance;
};

/// Fits centre, shape and blur; `converged` is false on failure.
Outline fit_outline(const GreyImage& image, const DarkMap& map, const NoiseModel& noise,
                    const Blob& blob, const BlurGuess& guess, double light_centre_fraction) {
  Outline result;
  DotFit& fit = result.fit;
  Vector& p = result.p;
  p = start_parameters(blob, guess);
  result.patch = cut_patch(image, map, blob, Model(p), light_centre_fraction);
  Patch& patch = result.patch;
  fit.masked_edge = patch.masked_edge;
  fit.saturated = patch.saturated;
  fit.centre_px = blob.centre_px;
  fit.shape_px2 = blob.shape_px2;
  fit.contrast = blob.bright - blob.dark;
  if (patch.pixels.size() < 2 * Model::size || !acceptable(p, patch)) return result;
  const bool dark_ring = set_dark_ring_aside(patch);
  result.pixels = PixelColumns(patch);
  if (!settle(patch, result.pixels, dark_ring, noise, guess, p, result.normal, fit)) return result;
  result.covariance = result.normal.hessian.ldlt().solve(Matrix::Identity());
  const double freedom = result.pixels.total_trust() - Model::size;
  if (!result.covariance.allFinite() || freedom < 1) return result;
  const Model model(p);
  fit.converged = true;
  fit.centre_px = patch.origin.cast<double>() + p.segment<2>(Model::cx);
  fit.shape_px2 = (model.outline() * model.outline()).inverse();
  fit.covariance_px2 = result.covariance.block<2, 2>(Model::cx, Model::cx);
  fit.masked_edge = std::max(fit.masked_edge, beyond_border(image, fit));
  fit.contrast = model.light_at_centre() * p(Model::print);
  fit.blur_px = p(Model::blur);
  fit.chi2_per_dof = result.normal.chi2 / freedom;
  fit.misfit = std::sqrt(fit.chi2_per_dof * noise.variance(model.light_at_centre())) /
               std::max(std::abs(fit.contrast), 1.0);
  return result;
}

}  // namespace

DotFit fit_dot(const GreyImage& image, const DarkMap& map, const NoiseModel& noise,
               const Blob& blob, const BlurGuess& guess, double light_centre_fraction,
               bool with_ring) {
  Outline found = fit_outline(image, map, noise, blob, guess, light_centre_fraction);
  DotFit& fit = found.fit;
  if (!fit.converged) return fit;
  const Model model(found.p);
  if (light_centre_fraction > 0) {
    fit.centre_fraction = centre_fraction(image, found.patch, model, 0.5 * light_centre_fraction);
  }
  check_sectors(found.pixels, noise, model, found.normal.hessian, fit);
  fit.edge = edge_residuals({found.patch, found.pixels, noise, model, found.covariance}, with_ring);
  return fit;
}

std::optional<double> blur_of_dot(const GreyImage& image, const DarkMap& map,
                                  const NoiseModel& noise, const Blob& blob,
                                  double light_centre_fraction) {
  const DotFit fit = fit_outline(image, map, noise, blob, {}, light_centre_fraction).fit;
  if (!fit.converged || fit.masked_edge >= most_covered_for_blur) return std::nullopt;
  return fit.blur_px;
}

Correlation frame_correlation(const std::vector<DotFit>& fits) {
  constexpr int classes = EdgeResiduals::classes;
  std::array<double, classes> product = {}, pairs = {};
  for (const DotFit& fit : fits) {
    const EdgeResiduals& dot = fit.edge;
    if (dot.product[0] <= 0) continue;
    // Each dot is scaled by its own variance, so that one bad fit does not dominate the frame.
    const double variance = dot.product[0] / dot.pairs[0];
    for (int k = 0; k < classes; ++k) {
      product[k] += dot.product[k] / variance;
      pairs[k] += dot.pairs[k];
    }
  }
  Correlation correlation;
  for (int k = 0; k < classes; ++k) {
    if (pairs[k] > 0) correlation.at[k] = product[k] / pairs[k];
  }
  correlation.texture = texture_of(fits);
  return correlation;
}

Eigen::Matrix2d honest_covariance(const DotFit& fit, const Correlation& correlation) {
  const EdgeResiduals& dot = fit.edge;
  if (dot.influence[0] <= 0) return fit.covariance_px2;
  double outline = 1, ring = 1;
  for (int k = 1; k < EdgeResiduals::classes; ++k) {
    outline += correlation.at[k] * dot.influence[k] / dot.influence[0];
  }
  for (int k = 0; k < RingResiduals::count; ++k) {
    ring += dot.light * correlation.texture(k) * dot.influence[RingResiduals::distances[k]] /
            dot.influence[0];
  }
  // The result is never below the frame's own noise.
  return fit.covariance_px2 * std::max(std::max(1.0, outline) * std::max(1.0, dot.chi2), ring);
}

}  // namespace drape::detect
