// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/propagation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

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
      : slope(0.5 * (effect.up_m - effect.down_m)), curve(0.5 * (effect.up_m + effect.down_m)) {}
  MatrixX3d slope, curve;
};

}  // namespace

double alone_m(const MatrixX3d& differences_m, const InputEffect& effect) {
  const Parabola path(effect);
  const double node = std::sqrt(effect.rectangular ? 0.6 : 3.0);
  const double weight = effect.rectangular ? 5.0 / 18 : 1.0 / 6;
  const double mean = mean_norm(differences_m);
  double squares = 0;
  for (const double z : {-node, node})
    squares +=
        weight * std::pow(mean_norm(differences_m + z * path.slope + z * z * path.curve) - mean, 2);
  return std::sqrt(squares);
}

double half_width_m(const MatrixX3d& differences_m, const std::vector<InputEffect>& effects,
                    double added_m, int draws) {
  std::vector<Parabola> paths(effects.begin(), effects.end());
  StandardDraws random;
  const double mean = mean_norm(differences_m);
  std::vector<double> off(static_cast<std::size_t>(draws));
  MatrixX3d drawn;
  for (double& one : off) {
    drawn = differences_m;
    for (std::size_t i = 0; i < effects.size(); ++i) {
      const double z = random.of(effects[i].rectangular);
      drawn += z * paths[i].slope + z * z * paths[i].curve;
    }
    one = std::abs(mean_norm(drawn) + added_m * random.normal() - mean);
  }
  const auto at = off.begin() + static_cast<std::ptrdiff_t>(0.95 * draws);
  std::nth_element(off.begin(), at, off.end());
  return *at;
}

}  // namespace drape::compare
