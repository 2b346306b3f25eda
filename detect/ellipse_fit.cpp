// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipse_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace drape {
namespace {

constexpr int size = 10;
using Vector = Eigen::Matrix<double, size, 1>;
using Matrix = Eigen::Matrix<double, size, size>;

// Parameters: centre x y, symmetric M (11 12 22) with |M (p - c)| = 1 on the outline, light b bx
// by, print k, blur s. Positions are relative to the patch origin.
enum Parameter { cx, cy, m11, m12, m22, light, light_x, light_y, print, blur };

constexpr double ring_px = 4.0;       // how far outside the outline pixels are used
constexpr double edge_px = 1.5;       // what counts as outline when hidden shares are counted
constexpr double far_in_blurs = 4.5;  // beyond this the edge function is constant
constexpr int foreign_margin_px = 2;
constexpr int most_iterations = 12;
constexpr double ring_start_px = 1.5;
constexpr double dark_ring_share = 0.7;
constexpr double stranger_px = 0.3;  // strangers are sought this far outside the outline
constexpr double biweight_limit = 6.0;
constexpr double gross_misfit = 0.15;  // of the contrast
constexpr double clean_chi2 = 2.5;     // fits up to here need no robust rounds
constexpr int robust_rounds = 4;
constexpr double saturated_level = 254.5;

struct Pixel {
  double x = 0, y = 0, level = 0;
  int sector = 0;
  double trust = 1;  // weight from the robust rounds
};

struct Patch {
  Eigen::Vector2i origin;
  int width = 0, height = 0;
  std::vector<Pixel> pixels;
  double masked_edge = 0;
  bool saturated = false;
};

struct Value {
  double level = 0;
  Vector gradient = Vector::Zero();
};

Eigen::Matrix2d symmetric(const Vector& p) {
  Eigen::Matrix2d m;
  m << p(m11), p(m12), p(m12), p(m22);
  return m;
}

double normal_cdf(double z) {
  return 0.5 * std::erfc(-z * std::numbers::sqrt2 / 2);
}

double normal_density(double z) {
  return std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi);
}

/// Signed distance from the outline to first order (Sampson 1982), with what its derivative needs.
struct Distance {
  double d = 0;
  Eigen::Vector2d u, v, w;
  double norm_w = 1;
};

Distance distance(const Vector& p, double x, double y) {
  Distance r;
  const Eigen::Matrix2d m = symmetric(p);
  r.u = {x - p(cx), y - p(cy)};
  r.v = m * r.u;
  r.w = m * r.v;
  r.norm_w = std::max(r.w.norm(), 1e-9);
  const double rho = r.v.norm();
  r.d = (rho - 1) * rho / r.norm_w;
  if (rho < 0.3) r.d = std::min(r.d, -0.7 / std::sqrt(m.squaredNorm()));
  return r;
}

Value evaluate(const Vector& p, double x, double y) {
  const Distance at = distance(p, x, y);
  const double z = at.d / p(blur);
  const double base = p(light) + p(light_x) * at.u.x() + p(light_y) * at.u.y();
  const double covered = normal_cdf(-z);
  const double through = 1 - p(print) * covered;
  Value value;
  value.level = base * through;
  Vector& g = value.gradient;
  g(light) = through;
  g(light_x) = at.u.x() * through;
  g(light_y) = at.u.y() * through;
  g(print) = -base * covered;
  g(cx) = -p(light_x) * through;
  g(cy) = -p(light_y) * through;
  if (std::abs(z) > far_in_blurs) return value;
  const double by_distance = base * p(print) * normal_density(z) / p(blur);
  g(cx) -= by_distance * at.w.x() / at.norm_w;
  g(cy) -= by_distance * at.w.y() / at.norm_w;
  g(m11) = by_distance * at.v.x() * at.u.x() / at.norm_w;
  g(m22) = by_distance * at.v.y() * at.u.y() / at.norm_w;
  g(m12) = by_distance * (at.v.x() * at.u.y() + at.v.y() * at.u.x()) / at.norm_w;
  g(blur) = -by_distance * z;
  return value;
}

/// Inverse symmetric square root.
Eigen::Matrix2d outline_matrix(const Eigen::Matrix2d& shape) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(shape).operatorInverseSqrt();
}

/// Marks the pixels of the patch that other dark regions touch.
std::vector<char> foreign_pixels(const DarkMap& map, const Blob& blob, const Patch& patch) {
  std::vector<char> foreign(static_cast<std::size_t>(patch.width) * patch.height, 0);
  const int m = foreign_margin_px;
  for (int y = -m; y < patch.height + m; ++y) {
    for (int x = -m; x < patch.width + m; ++x) {
      const int label = map.at(patch.origin.x() + x, patch.origin.y() + y);
      if (label == 0 || label == blob.label) continue;
      for (int v = std::max(0, y - m); v <= std::min(patch.height - 1, y + m); ++v) {
        for (int u = std::max(0, x - m); u <= std::min(patch.width - 1, x + m); ++u) {
          foreign[static_cast<std::size_t>(v) * patch.width + u] = 1;
        }
      }
    }
  }
  return foreign;
}

Patch cut_patch(const GreyImage& image, const DarkMap& map, const Blob& blob, Vector& p) {
  const Eigen::Vector2d half =
      blob.shape_px2.diagonal().cwiseSqrt() + Eigen::Vector2d::Constant(ring_px + 1);
  Patch patch;
  patch.origin = (blob.centre_px - half).array().floor().cast<int>();
  patch.width = static_cast<int>(std::ceil(2 * half.x())) + 2;
  patch.height = static_cast<int>(std::ceil(2 * half.y())) + 2;
  p.head<2>() = blob.centre_px - patch.origin.cast<double>();
  const std::vector<char> foreign = foreign_pixels(map, blob, patch);
  int edge = 0, hidden = 0;
  for (int y = 0; y < patch.height; ++y) {
    for (int x = 0; x < patch.width; ++x) {
      const Distance at = distance(p, x, y);
      if (at.d > ring_px) continue;
      const int u = patch.origin.x() + x, v = patch.origin.y() + y;
      const bool inside = u >= 0 && v >= 0 && u < image.width_px && v < image.height_px;
      const bool usable = inside && foreign[static_cast<std::size_t>(y) * patch.width + x] == 0;
      const bool on_edge = std::abs(at.d) < edge_px;
      edge += on_edge;
      hidden += on_edge && !usable;
      if (!usable) continue;
      const double angle = std::atan2(at.v.y(), at.v.x());
      const int sector = static_cast<int>(std::floor((angle / std::numbers::pi + 1) * 4)) & 7;
      const double level = image.level(u, v);
      patch.saturated = patch.saturated || level >= saturated_level;
      patch.pixels.push_back({static_cast<double>(x), static_cast<double>(y), level, sector});
    }
  }
  patch.masked_edge = edge == 0 ? 1.0 : static_cast<double>(hidden) / edge;
  return patch;
}

/// Before the first fit: ring pixels much darker than the brighter part of the ring are taken for
/// the table, or for cloth in shadow behind a silhouette. True when there were any.
bool set_dark_ring_aside(Patch& patch, const Vector& p) {
  std::vector<double> levels;
  std::vector<Pixel*> ring;
  for (Pixel& pixel : patch.pixels) {
    if (distance(p, pixel.x, pixel.y).d < ring_start_px) continue;
    ring.push_back(&pixel);
    levels.push_back(pixel.level);
  }
  if (levels.empty()) return false;
  const auto upper = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() * 3 / 4);
  std::nth_element(levels.begin(), upper, levels.end());
  bool any = false;
  for (Pixel* pixel : ring) {
    if (pixel->level < dark_ring_share * *upper) {
      pixel->trust = 0;
      any = true;
    }
  }
  return any;
}

struct Normal {
  Matrix hessian = Matrix::Zero();
  Vector gradient = Vector::Zero();
  double chi2 = 0;
};

void accumulate(Normal& normal, const Value& value, double residual, double weight) {
  normal.hessian.selfadjointView<Eigen::Lower>().rankUpdate(value.gradient, weight);
  normal.gradient += weight * residual * value.gradient;
  normal.chi2 += weight * residual * residual;
}

void add_prior(Normal& normal, const Vector& p, const BlurGuess& guess) {
  const double weight = 1 / (guess.sigma_px * guess.sigma_px);
  const double residual = guess.mean_px - p(blur);
  normal.hessian(blur, blur) += weight;
  normal.gradient(blur) += weight * residual;
  normal.chi2 += weight * residual * residual;
}

/// The noise is that of the model's level, not of the observed one, which would favour dark noise.
Normal linearise(const Patch& patch, const NoiseModel& noise, const Vector& p,
                 const BlurGuess& guess) {
  Normal normal;
  for (const Pixel& pixel : patch.pixels) {
    const Value value = evaluate(p, pixel.x, pixel.y);
    accumulate(normal, value, pixel.level - value.level, pixel.trust / noise.variance(value.level));
  }
  add_prior(normal, p, guess);
  return normal;
}

bool acceptable(const Vector& p, const Patch& patch) {
  const Eigen::Matrix2d m = symmetric(p);
  return p.allFinite() && p(blur) > 0.15 && p(blur) < 6 && p(light) > 0 && p(print) > 0.02 &&
         p(print) < 1.5 && m.trace() > 0 && m.determinant() > 1e-8 && p(cx) > 0 && p(cy) > 0 &&
         p(cx) < patch.width && p(cy) < patch.height;
}

/// Levenberg's damping on the scaled diagonal; ends when the centre moves by less than 1e-4 px.
bool iterate(const Patch& patch, const NoiseModel& noise, const BlurGuess& guess, Vector& p,
             Normal& normal) {
  double damping = 1e-4;
  normal = linearise(patch, noise, p, guess);
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    Matrix damped = normal.hessian.selfadjointView<Eigen::Lower>();
    damped.diagonal() *= 1 + damping;
    const Vector step = damped.ldlt().solve(normal.gradient);
    const Vector next = p + step;
    if (acceptable(next, patch)) {
      Normal there = linearise(patch, noise, next, guess);
      if (there.chi2 <= normal.chi2 * (1 + 1e-9)) {
        const bool done = step.head<2>().norm() < 1e-4 && damping < 1e-2;
        p = next;
        normal = std::move(there);
        damping = std::max(damping / 10, 1e-9);
        if (done) return true;
        continue;
      }
      if (step.head<2>().norm() < 1e-4) return true;
    }
    damping = std::max(damping * 20, 1e-3);
    if (damping > 1e6) return false;
  }
  return false;
}

/// Pixels outside the outline that belong to something else (the table or the cloth behind a
/// silhouette, a shadow's far side) lose their say: Tukey's biweight, but only for gross misfits,
/// since weights that follow the outline's small misfits would move the centre. Returns the share
/// of weight lost near the outline.
double distrust_strangers(Patch& patch, const NoiseModel& noise, const Vector& p) {
  std::vector<std::pair<double, Pixel*>> outside;
  std::vector<double> sizes;
  double edge = 0, lost = 0;
  for (Pixel& pixel : patch.pixels) {
    const double d = distance(p, pixel.x, pixel.y).d;
    edge += std::abs(d) < edge_px;
    if (d < stranger_px) continue;
    const Value value = evaluate(p, pixel.x, pixel.y);
    outside.emplace_back(pixel.level - value.level, &pixel);
    sizes.push_back(std::abs(outside.back().first));
  }
  if (sizes.empty()) return 0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  const double scale = std::max(noise.sigma(p(light)), *middle / 0.6745);
  const double limit = std::max(biweight_limit * scale, gross_misfit * p(light) * p(print));
  for (const auto& [residual, pixel] : outside) {
    const double keep = std::max(0.0, 1 - std::pow(residual / limit, 2));
    pixel->trust = keep * keep;
    if (distance(p, pixel->x, pixel->y).d < edge_px) lost += 1 - pixel->trust;
  }
  return edge == 0 ? 1.0 : lost / edge;
}

double total_trust(const Patch& patch) {
  double sum = 0;
  for (const Pixel& pixel : patch.pixels) sum += pixel.trust;
  return sum;
}

/// Shift of the centre when the pixels of one eighth of the dot are left out. White noise makes
/// its covariance C_rest - C_all, so a hidden part or a shadow's edge stands out.
void check_sectors(const Patch& patch, const NoiseModel& noise, const Vector& p,
                   const Matrix& hessian, const Matrix& covariance, DotFit& fit) {
  std::array<Normal, 8> sectors;
  for (const Pixel& pixel : patch.pixels) {
    const Value value = evaluate(p, pixel.x, pixel.y);
    accumulate(sectors[pixel.sector], value, pixel.level - value.level,
               pixel.trust / noise.variance(value.level));
  }
  for (const Normal& sector : sectors) {
    const Matrix rest = hessian - Matrix(sector.hessian.selfadjointView<Eigen::Lower>());
    const Eigen::LDLT<Matrix> solver(rest);
    if (solver.info() != Eigen::Success || !solver.isPositive()) continue;
    const Eigen::Vector2d shift = solver.solve(sector.gradient).head<2>();
    const Matrix rest_covariance = solver.solve(Matrix::Identity());
    const Eigen::Matrix2d expected =
        (rest_covariance - covariance).topLeftCorner<2, 2>() + 1e-8 * Eigen::Matrix2d::Identity();
    const double chi2 = shift.dot(expected.inverse() * shift);
    if (chi2 > fit.one_sided) {
      fit.one_sided = chi2;
      fit.one_sided_px = shift.norm();
    }
  }
}

/// Residuals weighted by what they do to the centre, alone and with their neighbours within two
/// pixels (lens blur correlates that far).
void weigh_residuals(const Patch& patch, const NoiseModel& noise, const Vector& p,
                     const Matrix& covariance, DotFit& fit) {
  const int stride = patch.width + 4;
  std::vector<Eigen::Vector2d> pull(static_cast<std::size_t>(stride) * (patch.height + 4),
                                    Eigen::Vector2d::Zero());
  const auto at = [&](int x, int y) -> Eigen::Vector2d& {
    return pull[static_cast<std::size_t>(y + 2) * stride + x + 2];
  };
  double alone = 0;
  for (const Pixel& pixel : patch.pixels) {
    const Value value = evaluate(p, pixel.x, pixel.y);
    at(static_cast<int>(pixel.x), static_cast<int>(pixel.y)) =
        covariance.topRows<2>() * value.gradient * (pixel.level - value.level) * pixel.trust /
        noise.variance(value.level);
  }
  double together = 0;
  for (const Pixel& pixel : patch.pixels) {
    const int x = static_cast<int>(pixel.x), y = static_cast<int>(pixel.y);
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int dy = -2; dy <= 2; ++dy) {
      for (int dx = -2; dx <= 2; ++dx) sum += at(x + dx, y + dy);
    }
    alone += at(x, y).squaredNorm();
    together += at(x, y).dot(sum);
  }
  const double expected = covariance.topLeftCorner<2, 2>().trace();
  fit.edge_chi2 = alone / expected;
  fit.edge_chi2_correlated = together / expected;
}

}  // namespace

DotFit fit_dot(const GreyImage& image, const DarkMap& map, const NoiseModel& noise,
               const Blob& start, const BlurGuess& guess) {
  Vector p = Vector::Zero();
  const Eigen::Matrix2d m = outline_matrix(start.shape_px2);
  p(m11) = m(0, 0);
  p(m12) = m(0, 1);
  p(m22) = m(1, 1);
  p(light) = start.bright;
  p(print) = std::clamp(1 - start.dark / std::max(start.bright, 1.0), 0.1, 1.0);
  p(blur) = guess.mean_px;
  Patch patch = cut_patch(image, map, start, p);
  DotFit fit;
  fit.masked_edge = patch.masked_edge;
  fit.saturated = patch.saturated;
  fit.centre_px = start.centre_px;
  fit.shape_px2 = start.shape_px2;
  fit.bright = start.bright;
  fit.contrast = start.bright - start.dark;
  if (patch.pixels.size() < 2 * size || !acceptable(p, patch)) return fit;
  const bool strangers = set_dark_ring_aside(patch, p);
  Normal normal;
  if (!iterate(patch, noise, guess, p, normal)) return fit;
  for (int round = 0; round < robust_rounds; ++round) {
    if (normal.chi2 <= clean_chi2 * total_trust(patch) && !(strangers && round == 0)) break;
    const double lost = distrust_strangers(patch, noise, p);
    fit.masked_edge = patch.masked_edge + (1 - patch.masked_edge) * lost;
    if (!iterate(patch, noise, guess, p, normal)) return fit;
  }
  const Matrix hessian = normal.hessian.selfadjointView<Eigen::Lower>();
  const Matrix covariance = hessian.ldlt().solve(Matrix::Identity());
  if (!covariance.allFinite()) return fit;
  fit.converged = true;
  fit.centre_px = patch.origin.cast<double>() + p.head<2>();
  fit.shape_px2 = (symmetric(p) * symmetric(p)).inverse();
  fit.covariance_px2 = covariance.topLeftCorner<2, 2>();
  fit.bright = p(light);
  fit.contrast = p(light) * p(print);
  fit.blur_px = p(blur);
  fit.chi2_per_dof = normal.chi2 / std::max(1.0, total_trust(patch) - size);
  check_sectors(patch, noise, p, hessian, covariance, fit);
  weigh_residuals(patch, noise, p, covariance, fit);
  return fit;
}

double correlation_factor(const std::vector<DotFit>& fits) {
  std::vector<double> factors;
  for (const DotFit& fit : fits) {
    if (fit.converged && fit.edge_chi2 > 0) {
      factors.push_back(fit.edge_chi2_correlated / fit.edge_chi2);
    }
  }
  if (factors.empty()) return 1;
  const auto middle = factors.begin() + static_cast<std::ptrdiff_t>(factors.size() / 2);
  std::nth_element(factors.begin(), middle, factors.end());
  return std::max(1.0, *middle);
}

Eigen::Matrix2d honest_covariance(const DotFit& fit, double factor) {
  return fit.covariance_px2 * factor * std::max(1.0, fit.edge_chi2);
}

}  // namespace drape
