// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/ellipse_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "detect/ellipses/blurred_ellipse.hpp"
#include "detect/ellipses/patch.hpp"
#include "detect/ellipses/pixel_columns.hpp"

namespace drape::detect {

namespace {

using Model = BlurredEllipse;
using Vector = Model::Vector;
using Matrix = Model::Matrix;

constexpr int most_iterations = 40;
constexpr double converged_px = 1e-3;    // the next Newton step is then well below 0.001 px
constexpr double quick_ratio = 0.2;      // largest ratio of successive step lengths
constexpr double converged_gain = 2e-4;  // decrease of chi-square: a tenth of one pixel's share
constexpr double chi2_scatter = 1e-6;    // rounding of single-precision sums
constexpr double clean_chi2 = 2.5;       // better fits need no second search for outliers
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

/// Fraction of the fitted outline outside the image. The region used at the start ends at the
/// border, so the patch cannot tell how much is missing.
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
  std::vector<const EdgeResiduals*> dots;
  for (const DotFit& fit : fits) {
    if (fit.converged) dots.push_back(&fit.edge);
  }
  return correlation_of(dots);
}

Eigen::Matrix2d honest_covariance(const DotFit& fit, const Correlation& correlation) {
  return fit.covariance_px2 * excess_of(fit.edge, correlation);
}

}  // namespace drape::detect
