// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "simulate/sparse/factor.hpp"

namespace drape::simulate {

/// Factors of one matrix after the other, in single precision for as long as that serves. Its
/// solutions are then good to about 1e-7 times the condition number, which iterating on the
/// residual in double precision makes up for (Wilkinson 1963; Langou et al. 2006).
class MixedFactor {
 public:
  /// True if a matrix that is not positive definite in single precision is tried in double.
  enum class Doubt { believe, ask_double };

  MixedFactor(const GridSpec& grid, int threads);

  /// False when the matrix plus diag(shift) is not positive definite, see GridFactor. Once double
  /// precision was asked, it stays.
  [[nodiscard]] bool factorise(const GridMatrix& matrix, const std::vector<double>& shift,
                               Doubt doubt);
  /// Solves in place with the last factor.
  void solve(Eigen::VectorXd& b) const;
  /// From here on in double precision; the factor in single precision is gone.
  void use_double();
  [[nodiscard]] bool in_double() const { return exact_.has_value(); }

 private:
  GridSpec grid_;
  int threads_;
  std::optional<GridFactor<float>> quick_;
  std::optional<GridFactor<double>> exact_;  ///< in its place
};

}  // namespace drape::simulate
