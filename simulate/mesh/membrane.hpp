// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "simulate/fabric/laws.hpp"

namespace drape::simulate {

/// Weighted sum of a state's vectors at the first N of the given unknowns.
template <std::size_t N, std::size_t M>
[[nodiscard]] Eigen::Vector3d combined(const std::array<double, N>& weight,
                                       const std::array<int, M>& unknown,
                                       const std::vector<Eigen::Vector3d>& state) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < N; ++k) sum += weight[k] * state[unknown[k]];
  return sum;
}

/// Metric (|x_u|^2, x_u . x_v, |x_v|^2).
[[nodiscard]] inline Eigen::Vector3d metric_of(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
  return {u.squaredNorm(), u.dot(v), v.squaredNorm()};
}

/// Stretches and shear angle of a metric.
struct MetricStrain {
  double a, b, sine;

  explicit MetricStrain(const Eigen::Vector3d& metric)
      : a(std::sqrt(std::max(metric[0], 1e-30))),
        b(std::sqrt(std::max(metric[2], 1e-30))),
        sine(std::clamp(metric[1] / (a * b), -1.0, 1.0)) {}
  [[nodiscard]] double angle() const { return std::asin(sine); }
  [[nodiscard]] double cosine() const { return std::max(std::sqrt(1 - sine * sine), 1e-9); }
  /// Derivatives by the metric of an energy with this moment per shear angle.
  [[nodiscard]] Eigen::Vector3d of_angle(double moment) const {
    return moment / cosine() *
           Eigen::Vector3d(-sine / (2 * a * a), 1 / (a * b), -sine / (2 * b * b));
  }
};

/// Derivatives of the membrane's energy per area by the metric, for a strain and its shear angle.
[[nodiscard]] inline Eigen::Vector3d stress_of(const MetricStrain& strain, double angle,
                                               const ClothLaws& laws) {
  return strain.of_angle(laws.shear.odd_value(angle)) +
         Eigen::Vector3d(laws.tensile[0].value(strain.a - 1) / (2 * strain.a), 0,
                         laws.tensile[1].value(strain.b - 1) / (2 * strain.b));
}

}  // namespace drape::simulate
