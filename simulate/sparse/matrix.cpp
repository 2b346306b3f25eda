// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/matrix.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace drape::simulate {

GridMatrix::GridMatrix(const GridSpec& grid)
    : grid_(grid),
      steps_{0, 1, 2, grid.cols - 1, grid.cols, grid.cols + 1, 2 * grid.cols},
      blocks_(static_cast<std::size_t>(grid.count()) * slots, Eigen::Matrix3d::Zero()) {}

void GridMatrix::set_zero() {
  std::fill(blocks_.begin(), blocks_.end(), Eigen::Matrix3d::Zero());
  std::fill(coupling_blocks_.begin(), coupling_blocks_.end(), Eigen::Matrix3d::Zero());
}

/// True if the pattern joins two particles.
bool GridMatrix::joins(int i, int j) const {
  const int rows = std::abs(i / grid_.cols - j / grid_.cols);
  const int cols = std::abs(i % grid_.cols - j % grid_.cols);
  return std::max(rows, cols) < 2 || (rows + cols == 2 && rows != cols);
}

void GridMatrix::couple(std::vector<Coupling> couplings) {
  for (Coupling& c : couplings) {
    if (c.high < c.low) std::swap(c.high, c.low);
  }
  std::sort(couplings.begin(), couplings.end());
  couplings.erase(std::unique(couplings.begin(), couplings.end()), couplings.end());
  couplings.erase(std::remove_if(couplings.begin(), couplings.end(),
                                 [&](const Coupling& c) { return joins(c.high, c.low); }),
                  couplings.end());
  couplings_ = std::move(couplings);
  coupling_blocks_.assign(couplings_.size(), Eigen::Matrix3d::Zero());
}

void GridMatrix::add_far(int i, int j, const Eigen::Matrix3d& block) {
  if (joins(i, j)) {
    add(i, j, block);
    return;
  }
  const Coupling wanted{std::max(i, j), std::min(i, j)};
  const auto at = std::lower_bound(couplings_.begin(), couplings_.end(), wanted);
  Eigen::Matrix3d& to = coupling_blocks_[at - couplings_.begin()];
  if (i > j) {
    to += block;
  } else {
    to += block.transpose();
  }
}

void GridMatrix::release(int particle) {
  for (std::size_t k = 0; k < couplings_.size(); ++k) {
    if (couplings_[k].high == particle || couplings_[k].low == particle)
      coupling_blocks_[k].setZero();
  }
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
  for (std::size_t k = 0; k < couplings_.size(); ++k) {
    const auto& [high, low] = couplings_[k];
    product.segment<3>(3 * high) += coupling_blocks_[k] * x.segment<3>(3 * low);
    product.segment<3>(3 * low) += coupling_blocks_[k].transpose() * x.segment<3>(3 * high);
  }
}

}  // namespace drape::simulate
