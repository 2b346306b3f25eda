// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/propagation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "core/statistics/sample.hpp"

namespace drape::compare {
namespace {

using Eigen::MatrixX3d;

double mean_norm(const MatrixX3d& rows) {
  return rows.rowwise().norm().mean();
}

/// Uniform in (0, 1) and standard normal, the same on every platform.
class StandardDraws {
 public:
  double uniform() { return (static_cast<double>(words_()) + 0.5) / 4294967296.0; }
  double normal() {  // Box and Muller 1958
    return std::sqrt(-2 * std::log(uniform())) * std::cos(2 * std::numbers::pi * uniform());
  }
  double of(bool rectangular) { return rectangular ? 2 * uniform() - 1 : normal(); }

 private:
  std::mt19937 words_{101};
};

/// The parabola's slope and curvature.
struct Parabola {
  explicit Parabola(const InputEffect& effect)
      : slope(0.5 * (effect.up_m - effect.down_m)),
        curve(0.5 * (effect.up_m + effect.down_m)),
        node(std::sqrt(effect.rectangular ? 0.6 : 3.0)),
        weight(effect.rectangular ? 5.0 / 18 : 1.0 / 6) {}
  MatrixX3d slope, curve;
  double node, weight;  ///< outer nodes of Gauss quadrature of order five, and their weight
};

/// Variance of the mean norm where one input alone errs about `z`, at which the rows are `at_m`.
double variance_alone(const MatrixX3d& at_m, double mean, const Parabola& path, double z) {
  double squares = 0;
  for (const double step : {-path.node, path.node}) {
    const double bend = (2 * z + step) * step;
    double sum = 0;
    for (Eigen::Index k = 0; k < at_m.rows(); ++k)
      sum += (at_m.row(k) + step * path.slope.row(k) + bend * path.curve.row(k)).norm();
    squares += path.weight * std::pow(sum / static_cast<double>(at_m.rows()) - mean, 2);
  }
  return squares;
}

}  // namespace

double alone_m(const MatrixX3d& differences_m, const InputEffect& effect) {
  return std::sqrt(variance_alone(differences_m, mean_norm(differences_m), Parabola(effect), 0));
}

double half_width_m(const MatrixX3d& differences_m, const std::vector<InputEffect>& effects,
                    double added_m, int draws) {
  const std::vector<Parabola> paths(effects.begin(), effects.end());
  StandardDraws random;
  const double mean = mean_norm(differences_m);
  std::vector<double> z(effects.size(), 0.0);
  const auto deviation = [&](const MatrixX3d& at_m, double at_mean) {
    double variance = added_m * added_m;
    for (std::size_t i = 0; i < paths.size(); ++i)
      variance += variance_alone(at_m, at_mean, paths[i], z[i]);
    return std::sqrt(variance);
  };
  const double here = deviation(differences_m, mean);
  if (!(here > 0)) return 0;
  const auto count = static_cast<std::size_t>(draws);
  std::vector<double> off_m(count), by_deviation(count);
  MatrixX3d drawn;
  for (std::size_t k = 0; k < count; ++k) {
    drawn = differences_m;
    for (std::size_t i = 0; i < effects.size(); ++i) {
      z[i] = random.of(effects[i].rectangular);
      drawn += z[i] * paths[i].slope + z[i] * z[i] * paths[i].curve;
    }
    const double there = mean_norm(drawn);
    off_m[k] = std::abs(there + added_m * random.normal() - mean);
    by_deviation[k] = off_m[k] / deviation(drawn, there);
  }
  const auto rank = static_cast<std::size_t>(0.95 * draws);
  return std::max(order_statistic(std::move(off_m), rank),
                  here * order_statistic(std::move(by_deviation), rank));
}

}  // namespace drape::compare
