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

}  // namespace drape::simulate
