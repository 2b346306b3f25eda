// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/matrix.hpp"

#include <algorithm>

namespace drape::simulate {

GridMatrix::GridMatrix(const GridSpec& grid)
    : grid_(grid),
      steps_{0, 1, 2, grid.cols - 1, grid.cols, grid.cols + 1, 2 * grid.cols},
      blocks_(static_cast<std::size_t>(grid.count()) * slots, Eigen::Matrix3d::Zero()) {}

void GridMatrix::set_zero() {
  std::fill(blocks_.begin(), blocks_.end(), Eigen::Matrix3d::Zero());
}

int GridMatrix::slot_of_step(int j, int step) const {
  // Only on the narrowest grids a small step may lead to the next row.
  if (step <= 2 && (grid_.cols > 3 || j % grid_.cols + step < grid_.cols)) return step;
  if (step >= 2 * grid_.cols) return 6;
  return step - (grid_.cols - 1) + 3;
}

bool GridMatrix::has(int j, int slot) const {
  static constexpr int kRows[slots] = {0, 0, 0, 1, 1, 1, 2};
  static constexpr int kCols[slots] = {0, 1, 2, -1, 0, 1, 0};
  const int row = j / grid_.cols + kRows[slot];
  const int col = j % grid_.cols + kCols[slot];
  return row < grid_.rows && col >= 0 && col < grid_.cols;
}

void GridMatrix::multiply(const Eigen::VectorXd& x, Eigen::VectorXd& product) const {
  product.setZero(x.size());
  for (int j = 0; j < grid_.count(); ++j) {
    const Eigen::Vector3d xj = x.segment<3>(3 * j);
    Eigen::Vector3d sum = blocks_[static_cast<std::size_t>(j) * slots] * xj;
    for (int s = 1; s < slots; ++s) {
      if (!has(j, s)) continue;
      const int i = j + steps_[s];
      const Eigen::Matrix3d& block = blocks_[static_cast<std::size_t>(j) * slots + s];
      product.segment<3>(3 * i) += block * xj;
      sum += block.transpose() * x.segment<3>(3 * i);
    }
    product.segment<3>(3 * j) += sum;
  }
}

}  // namespace drape::simulate
