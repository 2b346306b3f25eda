// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <vector>

#include "simulate/cloth/cloth.hpp"

namespace drape::simulate {

/// Symmetric matrix of 3x3 blocks over the particles of a grid, on the pattern of the cloth's
/// elements: a particle meets its eight neighbours and the second next along both grid lines. Where
/// layers of the sheet press on each other, far particles are coupled as well: couple() says which.
/// Vectors are interleaved: x, y, z of particle 0, of particle 1, ...
class GridMatrix {
 public:
  static constexpr int slots = 7;

  /// Two particles that the pattern does not join.
  struct Coupling {
    int high = 0, low = 0;  ///< row and column particle
    auto operator<=>(const Coupling&) const =
        default;  // NOLINT(modernize-use-nullptr): by the compiler
  };

  explicit GridMatrix(const GridSpec& grid);

  void set_zero();
  /// Joins these pairs of particles, too, in place of those joined before; their blocks are zero.
  /// Pairs that the pattern has, and those named before, are left out.
  void couple(std::vector<Coupling> couplings);
  /// As add(), for any two particles of the pattern or of couple().
  void add_far(int i, int j, const Eigen::Matrix3d& block);
  /// Takes out what couples a particle to far ones.
  void release(int particle);
  [[nodiscard]] const std::vector<Coupling>& couplings() const { return couplings_; }
  [[nodiscard]] const Eigen::Matrix3d& coupling_block(int k) const { return coupling_blocks_[k]; }
  /// Adds `block` at (row particle i, column particle j); call once per unordered pair, and with
  /// i = j for the diagonal.
  void add(int i, int j, const Eigen::Matrix3d& block) {
    if (i >= j) {
      blocks_[slot(j, i - j)] += block;
    } else {
      blocks_[slot(i, j - i)] += block.transpose();
    }
  }
  [[nodiscard]] const Eigen::Matrix3d& diagonal(int i) const { return blocks_[i * slots]; }
  /// product = matrix times x.
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& product) const;

  [[nodiscard]] const GridSpec& grid() const { return grid_; }
  /// Index step of a slot, 0 .. slots - 1.
  [[nodiscard]] int step(int slot) const { return steps_[slot]; }
  [[nodiscard]] const Eigen::Matrix3d& block(int j, int slot) const {
    return blocks_[static_cast<std::size_t>(j) * slots + slot];
  }
  /// True if particle j has a neighbour at that slot.
  [[nodiscard]] bool has(int j, int slot) const;

 private:
  [[nodiscard]] std::size_t slot(int j, int step) const {
    return static_cast<std::size_t>(j) * slots + slot_of_step(j, step);
  }
  [[nodiscard]] int slot_of_step(int j, int step) const;
  [[nodiscard]] bool joins(int i, int j) const;

  GridSpec grid_;
  std::array<int, slots> steps_{};
  std::vector<Eigen::Matrix3d> blocks_;
  std::vector<Coupling> couplings_;  ///< in order
  std::vector<Eigen::Matrix3d> coupling_blocks_;
};

}  // namespace drape::simulate
