// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace drape::simulate {

/// A vector at each of n particles: three blocks x, y, z of n values each, so that loops over all
/// particles vectorise.
using Field = std::vector<double>;

/// The vector of particle i.
[[nodiscard]] inline Eigen::Vector3d at(const Field& x, int i) {
  const std::size_t n = x.size() / 3;
  return {x[i], x[n + i], x[2 * n + i]};
}
inline void put_at(Field& x, int i, const Eigen::Vector3d& value) {
  const std::size_t n = x.size() / 3;
  x[i] = value.x();
  x[n + i] = value.y();
  x[2 * n + i] = value.z();
}
inline void add_at(Field& x, int i, const Eigen::Vector3d& value) {
  const std::size_t n = x.size() / 3;
  x[i] += value.x();
  x[n + i] += value.y();
  x[2 * n + i] += value.z();
}

/// Mean distance of the particles of two sheets of one grid.
[[nodiscard]] inline double mean_distance_m(const Field& a, const Field& b) {
  const int n = static_cast<int>(a.size() / 3);
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += (at(a, i) - at(b, i)).norm();
  return sum / n;
}

}  // namespace drape::simulate
