// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipse_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "detect/blurred_ellipse.hpp"
#include "detect/patch.hpp"

namespace drape {
namespace {

using Model = BlurredEllipse;
using Vector = Model::Vector;
using Matrix = Model::Matrix;

constexpr int most_iterations = 15;
constexpr double converged_px = 1e-3;  // Newton's next step is then far below a thousandth
constexpr double clean_chi2 = 2.5;     // fits up to here need no second look at strangers
constexpr int stranger_rounds = 4;

/// Normal equations of the weighted least squares, lower triangle.
struct Normal {
  Matrix hessian = Matrix::Zero();
  Vector gradient = Vector::Zero();
  double chi2 = 0;

  void add(const Vector& g, int count, double residual, double weight) {
    for (int col = 0; col < count; ++col) {
      const double scaled = weight * g(col);
      gradient(col) += scaled * residual;
      for (int row = col; row < count; ++row) hessian(row, col) += scaled * g(row);
    }
    chi2 += weight * residual * residual;
  }

  [[nodiscard]] Matrix full() const { return hessian.selfadjointView<Eigen::Lower>(); }
};

void add_prior(Normal& normal, double blur_px, const BlurGuess& guess) {
  const double weight = 1 / (guess.sigma_px * guess.sigma_px);
  const double residual = guess.mean_px - blur_px;
  normal.hessian(Model::blur, Model::blur) += weight;
  normal.gradient(Model::blur) += weight * residual;
  normal.chi2 += weight * residual * residual;
}

/// Adds a pixel with the noise of the model's level, not of the observed one, which would favour
/// dark noise.
void add_pixel(Normal& normal, const Model& model, const PatchPixel& pixel,
               const NoiseModel& noise) {
  Vector g;
  const Model::Sample sample = model.evaluate(pixel.x, pixel.y, g);
  normal.add(g, sample.near_edge ? Model::size : Model::light_size, pixel.level - sample.level,
             pixel.trust / noise.variance(sample.level));
}

Normal linearise(const Patch& patch, const NoiseModel& noise, const Model& model,
                 const BlurGuess& guess) {
  Normal normal;
  for (const PatchPixel& pixel : patch.pixels) add_pixel(normal, model, pixel, noise);
  add_prior(normal, model.parameters()(Model::blur), guess);
  return normal;
}

bool acceptable(const Vector& p, const Patch& patch) {
  const Eigen::Matrix2d m = Model(p).outline();
  return p.allFinite() && p(Model::blur) > 0.15 && p(Model::blur) < 6 && p(Model::light) > 0 &&
         p(Model::print) > 0.02 && p(Model::print) < 1.5 && m.trace() > 0 &&
         m.determinant() > 1e-8 && std::abs(p(Model::cx)) < patch.reach_x &&
         std::abs(p(Model::cy)) < patch.reach_y;
}

/// Gauss-Newton with Levenberg's damping on the scaled diagonal.
bool iterate(const Patch& patch, const NoiseModel& noise, const BlurGuess& guess, Vector& p,
             Normal& normal) {
  double damping = 1e-6;
  normal = linearise(patch, noise, Model(p), guess);
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    Matrix damped = normal.full();
    damped.diagonal() *= 1 + damping;
    const Vector step = damped.ldlt().solve(normal.gradient);
    const Vector next = p + step;
    const bool small = step.segment<2>(Model::cx).norm() < converged_px;
    if (acceptable(next, patch)) {
      Normal there = linearise(patch, noise, Model(next), guess);
      if (there.chi2 <= normal.chi2 * (1 + 1e-9)) {
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

/// Shift of the centre when the pixels of one eighth of the dot are left out. White noise makes
/// its covariance C_rest - C_all, so a hidden part or a shadow's edge stands out.
void check_sectors(const Patch& patch, const NoiseModel& noise, const Model& model,
                   const Matrix& hessian, const Matrix& covariance, DotFit& fit) {
  std::array<Normal, 8> sectors;
  for (const PatchPixel& pixel : patch.pixels) {
    add_pixel(sectors[pixel.sector], model, pixel, noise);
  }
  for (const Normal& sector : sectors) {
    const Eigen::LDLT<Matrix> solver(hessian - sector.full());
    if (solver.info() != Eigen::Success || !solver.isPositive()) continue;
    const Eigen::Vector2d shift = solver.solve(sector.gradient).segment<2>(Model::cx);
    Eigen::Matrix<double, Model::size, 2> unit = Eigen::Matrix<double, Model::size, 2>::Zero();
    unit(Model::cx, 0) = unit(Model::cy, 1) = 1;
    const Eigen::Matrix2d rest = solver.solve(unit).block<2, 2>(Model::cx, 0);
    const Eigen::Matrix2d expected =
        rest - covariance.block<2, 2>(Model::cx, Model::cx) + 1e-8 * Eigen::Matrix2d::Identity();
    const double chi2 = shift.dot(expected.inverse() * shift);
    if (chi2 > fit.one_sided) {
      fit.one_sided = chi2;
      fit.one_sided_px = shift.norm();
    }
  }
}

/// Sums residuals and sensitivities over pairs of pixels near the outline.
void weigh_residuals(const Patch& patch, const NoiseModel& noise, const Model& model,
                     const Matrix& covariance, DotFit& fit) {
  constexpr int reach = 3;
  struct Cell {
    double residual = 0;
    Eigen::Vector2d sensitivity = Eigen::Vector2d::Zero();
    bool used = false;
  };
  const int stride = 2 * (patch.reach_x + reach) + 1;
  std::vector<Cell> cells(static_cast<std::size_t>(stride) * (2 * (patch.reach_y + reach) + 1));
  const auto at = [&](int x, int y) -> Cell& {
    return cells[static_cast<std::size_t>(y + patch.reach_y + reach) * stride + x + patch.reach_x +
                 reach];
  };
  const Eigen::Matrix<double, 2, Model::size> rows = covariance.middleRows<2>(Model::cx);
  double weighted = 0;
  for (const PatchPixel& pixel : patch.pixels) {
    Vector g;
    const Model::Sample sample = model.evaluate(pixel.x, pixel.y, g);
    if (!sample.near_edge || pixel.trust < 0.5) continue;
    const double sigma = noise.sigma(sample.level);
    at(pixel.x, pixel.y) = {(pixel.level - sample.level) / sigma, rows * g / sigma, true};
  }
  for (const PatchPixel& pixel : patch.pixels) {
    const Cell& here = at(pixel.x, pixel.y);
    if (!here.used) continue;
    weighted += here.sensitivity.squaredNorm() * here.residual * here.residual;
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        const Cell& there = at(pixel.x + dx, pixel.y + dy);
        if (!there.used) continue;
        const int distance = dx * dx + dy * dy;
        fit.edge.product[distance] += here.residual * there.residual;
        fit.edge.pairs[distance] += 1;
        fit.edge.influence[distance] += here.sensitivity.dot(there.sensitivity);
      }
    }
  }
  if (fit.edge.influence[0] > 0) fit.edge.chi2 = weighted / fit.edge.influence[0];
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

/// Fits, and fits again while pixels turn out to belong to something else.
bool settle(Patch& patch, const NoiseModel& noise, const BlurGuess& guess, Vector& p,
            Normal& normal, DotFit& fit) {
  const bool strangers = set_dark_ring_aside(patch, Model(p));
  if (!iterate(patch, noise, guess, p, normal)) return false;
  for (int round = 0; round < stranger_rounds; ++round) {
    const bool clean = normal.chi2 <= clean_chi2 * patch.total_trust();
    if (clean && !(strangers && round == 0)) break;
    const Strangers found = distrust_strangers(patch, noise, Model(p));
    fit.masked_edge = patch.masked_edge + (1 - patch.masked_edge) * found.lost_edge;
    if (!found.changed) break;
    if (!iterate(patch, noise, guess, p, normal)) return false;
  }
  return true;
}

}  // namespace

DotFit fit_dot(const GreyImage& image, const DarkMap& map, const NoiseModel& noise,
               const Blob& blob, const BlurGuess& guess) {
  Vector p = start_parameters(blob, guess);
  Patch patch = cut_patch(image, map, blob, Model(p));
  DotFit fit;
  fit.masked_edge = patch.masked_edge;
  fit.saturated = patch.saturated;
  fit.centre_px = blob.centre_px;
  fit.shape_px2 = blob.shape_px2;
  fit.contrast = blob.bright - blob.dark;
  if (patch.pixels.size() < 2 * Model::size || !acceptable(p, patch)) return fit;
  Normal normal;
  if (!settle(patch, noise, guess, p, normal, fit)) return fit;
  const Matrix hessian = normal.full();
  const Matrix covariance = hessian.ldlt().solve(Matrix::Identity());
  const double freedom = patch.total_trust() - Model::size;
  if (!covariance.allFinite() || freedom < 1) return fit;
  const Model model(p);
  fit.converged = true;
  fit.centre_px = patch.origin.cast<double>() + p.segment<2>(Model::cx);
  fit.shape_px2 = (model.outline() * model.outline()).inverse();
  fit.covariance_px2 = covariance.block<2, 2>(Model::cx, Model::cx);
  fit.contrast = model.light_at_centre() * p(Model::print);
  fit.blur_px = p(Model::blur);
  fit.chi2_per_dof = normal.chi2 / freedom;
  check_sectors(patch, noise, model, hessian, covariance, fit);
  weigh_residuals(patch, noise, model, covariance, fit);
  return fit;
}

Correlation frame_correlation(const std::vector<DotFit>& fits) {
  Correlation product = {}, pairs = {};
  for (const DotFit& fit : fits) {
    if (!fit.converged || fit.edge.product[0] <= 0) continue;
    // Each dot in units of its own variance, so that one bad fit does not speak for the frame.
    const double variance = fit.edge.product[0] / fit.edge.pairs[0];
    for (int k = 0; k < EdgeResiduals::classes; ++k) {
      product[k] += fit.edge.product[k] / variance;
      pairs[k] += fit.edge.pairs[k];
    }
  }
  Correlation correlation = {};
  for (int k = 0; k < EdgeResiduals::classes; ++k) {
    if (pairs[k] > 0) correlation[k] = product[k] / pairs[k];
  }
  return correlation;
}

Eigen::Matrix2d honest_covariance(const DotFit& fit, const Correlation& correlation) {
  if (fit.edge.influence[0] <= 0) return fit.covariance_px2;
  double factor = 1;
  for (int k = 1; k < EdgeResiduals::classes; ++k) {
    factor += correlation[k] * fit.edge.influence[k] / fit.edge.influence[0];
  }
  // Noise may only add to what the frame's own noise gives.
  return fit.covariance_px2 * std::max(1.0, factor) * std::max(1.0, fit.edge.chi2);
}

}  // namespace drape
