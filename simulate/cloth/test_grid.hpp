// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "simulate/cloth/cloth.hpp"
#include "simulate/fabric/test_laws.hpp"

/// Cloth on a particle grid for tests.
namespace drape::simulate {

/// Positions by a map from material coordinates (m) to space.
template <class Map>
[[nodiscard]] Field shaped(const GridSpec& grid, const Map& map) {
  Field x(3 * static_cast<std::size_t>(grid.count()));
  for (int i = 0; i < grid.count(); ++i)
    put_at(x, i,
           map(int{i / grid.cols} * grid.warp_spacing_m(), i % grid.cols * grid.weft_spacing_m()));
  return x;
}

/// A sheet of a few centimetres that is stretched, sheared, bent and twisted everywhere.
[[nodiscard]] inline Field crumpled(const GridSpec& grid) {
  return shaped(grid, [](double u, double v) {
    return Eigen::Vector3d(1.012 * u + 0.05 * v + 2e-4 * std::sin(900 * u + 300 * v),
                           0.99 * v + 0.002 * std::sin(60 * u), 0.006 * std::sin(70 * u + 40 * v));
  });
}

/// Both thread families keep their length and turn by half the angle.
[[nodiscard]] inline Field trellis(const GridSpec& grid, double angle) {
  const double c = std::cos(angle / 2), s = std::sin(angle / 2);
  return shaped(
      grid, [=](double u, double v) { return Eigen::Vector3d(u * c + v * s, u * s + v * c, 0); });
}

[[nodiscard]] inline Field forces_of(Cloth& cloth, const Field& x,
                                     const Field* velocity = nullptr) {
  Field force(x.size(), 0.0);
  cloth.add_forces(x, velocity, force);
  return force;
}

/// Expects internal forces of a sheet of 6 cm to have no sum and no moment.
inline void expect_balanced(const Field& x, const Field& force) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
  double scale = 0;
  for (int i = 0; i < static_cast<int>(x.size() / 3); ++i) {
    sum += at(force, i);
    moment += at(x, i).cross(at(force, i));
    scale += at(force, i).norm();
  }
  EXPECT_LT(sum.norm(), 1e-13 * scale);
  EXPECT_LT(moment.norm(), 1e-13 * scale * 0.06);
}

/// Square of the highest frequency (1/s) about a state, by power iteration on differences of the
/// forces.
[[nodiscard]] inline double highest_frequency_squared(Cloth& cloth, const Field& x) {
  constexpr double kStep = 1e-9;
  Field mode(x.size());
  for (std::size_t i = 0; i < mode.size(); ++i)
    mode[i] = std::sin(1.7 * static_cast<double>(i * i));
  double omega_squared = 0;
  for (int round = 0; round < 300; ++round) {
    double norm = 0;
    for (const double m : mode) norm += m * m;
    Field plus = x, minus = x;
    for (std::size_t i = 0; i < x.size(); ++i) {
      mode[i] /= std::sqrt(norm);
      plus[i] += kStep * mode[i];
      minus[i] -= kStep * mode[i];
    }
    const Field f_plus = forces_of(cloth, plus), f_minus = forces_of(cloth, minus);
    omega_squared = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double next =
          (f_minus[i] - f_plus[i]) / (2 * kStep) / cloth.mass_kg()[i % cloth.count()];
      omega_squared += next * mode[i];
      mode[i] = next;
    }
  }
  return omega_squared;
}

}  // namespace drape::simulate
