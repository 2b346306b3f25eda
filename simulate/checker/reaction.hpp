// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <vector>

#include "simulate/checker/sheet.hpp"

/// What the search for balancing forces counts with; for balance.cpp.
namespace drape::simulate::checker {

using Vector3 = Eigen::Matrix<Real, 3, 1>;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;
using VectorX = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Sparse = Eigen::SparseMatrix<Real>;

inline Vector3 vector_of(const Point& p) {
  return {p[0], p[1], p[2]};
}

inline Real size_of(const Point& f) {
  return std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
}

inline Real largest_of(const std::vector<Point>& force) {
  Real most = 0;
  for (const Point& f : force) most = std::max(most, size_of(f));
  return most;
}

/// Force at one support: coordinates are friction times pressing and the two tangential ones, so
/// that the cone is |tangential| <= first.
struct Reaction {
  Matrix3 axes;  ///< force = axes * value
  Vector3 value, change;
  Matrix3 own_spread;  ///< inverse of the barrier's second derivative

  [[nodiscard]] static Real room(const Vector3& v) {
    return v[0] > 0 ? v[0] * v[0] - v[1] * v[1] - v[2] * v[2] : -1;
  }
};

}  // namespace drape::simulate::checker
