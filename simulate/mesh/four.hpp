// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulate/fabric/wide.hpp"

namespace drape::simulate {

/// Three coordinates and a zero, in one or two registers; a double* may point into it.
using Four = double __attribute__((vector_size(32), aligned(8), may_alias));

[[nodiscard]] DRAPE_INLINE double dot(const Four& a, const Four& b) {
  const Four product = a * b;
  return product[0] + product[1] + product[2];
}

/// Sets the weighted sum of `x` at `N` unknowns.
template <std::size_t N, class Weights, class Unknowns>
DRAPE_INLINE void set_sum(Four& sum, const Weights& weight, const Unknowns& unknown,
                          const Four* x) {
  sum = weight[0] * x[unknown[0]];
#pragma GCC unroll 12
  for (std::size_t k = 1; k < N; ++k) sum += weight[k] * x[unknown[k]];
}

/// An array of `count` vectors, initially zero.
class Fours {
 public:
  Fours() = default;
  explicit Fours(std::size_t count) : values_(4 * count, 0.0) {}
  [[nodiscard]] Four* data() { return reinterpret_cast<Four*>(values_.data()); }
  [[nodiscard]] Four& operator[](std::size_t i) { return data()[i]; }
  void set(std::size_t i, const Eigen::Vector3d& vector) {
    for (int k = 0; k < 3; ++k) values_[4 * i + k] = vector[k];
  }
  [[nodiscard]] Eigen::Map<const Eigen::Vector3d> at(std::size_t i) const {
    return Eigen::Map<const Eigen::Vector3d>(values_.data() + 4 * i);
  }

 private:
  std::vector<double> values_;
};

}  // namespace drape::simulate
