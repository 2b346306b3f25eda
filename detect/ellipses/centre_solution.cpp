// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/centre_solution.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>

namespace drape::detect {

std::optional<CentreSolution> solve_for_centre(const BlurredEllipse::Matrix& hessian,
                                               const BlurredEllipse::Vector& gradient) {
  using Fitted = BlurredEllipse;
  constexpr int n = Fitted::size;
  static_assert(n == 10 && Fitted::cx == 4 && Fitted::cy == 5);
  constexpr std::array<int, n> order = {0, 1, 2, 3, 6, 7, 8, 9, Fitted::cx, Fitted::cy};
  // Columns of the lower triangle; row n is the right side, which is eliminated with the others.
  std::array<std::array<double, n + 1>, n> column;
  for (int k = 0; k < n; ++k) {
    for (int row = k; row < n; ++row) column[k][row] = hessian(order[row], order[k]);
    column[k][n] = gradient(order[k]);
  }
  for (int k = 0; k < n; ++k) {
    if (!(column[k][k] > 0)) return std::nullopt;
    const double per_root = 1 / std::sqrt(column[k][k]);
    for (int row = k; row <= n; ++row) column[k][row] *= per_root;
    for (int next = k + 1; next < n; ++next) {
      const double factor = column[k][next];
      for (int row = next; row <= n; ++row) column[next][row] -= factor * column[k][row];
    }
  }
  Eigen::Matrix2d root = Eigen::Matrix2d::Zero();
  root << column[n - 2][n - 2], 0, column[n - 2][n - 1], column[n - 1][n - 1];
  const Eigen::Matrix2d undo = root.inverse();
  return CentreSolution{undo.transpose() * Eigen::Vector2d(column[n - 2][n], column[n - 1][n]),
                        undo.transpose() * undo};
}

}  // namespace drape::detect
