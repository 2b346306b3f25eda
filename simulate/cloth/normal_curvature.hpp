// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

#include "simulate/cloth/cloth.hpp"
#include "simulate/mesh/normal_curvature.hpp"

namespace drape::simulate {

/// The particles that the bending of a triple depends on, with the weights of the curvature vector
/// (1/m^2) and of two differences along the sheet. Where a line beside the triple is missing, the
/// difference across it is one-sided.
struct CurvatureStencil {
  std::array<int, 5> particle{};
  std::array<double, 5> c{}, a{}, b{};
};
/// Curvature of the triple with middle particle i along `direction`.
[[nodiscard]] CurvatureStencil curvature_stencil(const Cloth& cloth, int direction, int i);

/// The sum of x over a stencil.
[[nodiscard]] inline Eigen::Vector3d weigh(const CurvatureStencil& stencil,
                                           const std::array<double, 5>& weight, const Field& x) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 5; ++k) {
    if (weight[k] != 0) sum += weight[k] * at(x, stencil.particle[k]);
  }
  return sum;
}

}  // namespace drape::simulate
