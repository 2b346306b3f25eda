// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "simulate/dynamics/motion.hpp"
#include "simulate/sparse/factor.hpp"

namespace drape::simulate {

// A point that is a mixture of up to four particles: anything with `particle` and `weight`.

template <class Mixture>
Eigen::Vector3d mix(const Field& field, const Mixture& point) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    if (point.weight[k] != 0) sum += point.weight[k] * at(field, point.particle[k]);
  }
  return sum;
}

template <class Mixture>
Eigen::Vector3d mix_step(const Eigen::VectorXd& step, const Mixture& point) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    if (point.weight[k] != 0) sum += point.weight[k] * step.segment<3>(3 * point.particle[k]);
  }
  return sum;
}

template <class Mixture>
void spread(const Mixture& point, const Eigen::Vector3d& total, Field& force) {
  for (int k = 0; k < 4; ++k) {
    if (point.weight[k] != 0) add_at(force, point.particle[k], point.weight[k] * total);
  }
}

template <class Mixture>
void spread_step(const Mixture& point, const Eigen::Vector3d& total, Eigen::VectorXd& sum) {
  for (int k = 0; k < 4; ++k) {
    if (point.weight[k] != 0) sum.segment<3>(3 * point.particle[k]) += point.weight[k] * total;
  }
}

template <class Mixture>
void add_mixture(const Mixture& point, const Eigen::Matrix3d& block, GridMatrix& hessian) {
  for (int k = 0; k < 4; ++k) {
    if (point.weight[k] == 0) continue;
    for (int l = 0; l <= k; ++l) {
      if (point.weight[l] == 0) continue;
      hessian.add(point.particle[k], point.particle[l], point.weight[k] * point.weight[l] * block);
    }
  }
}

}  // namespace drape::simulate
