// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "simulate/cloth.hpp"

namespace drape::sim {

/// Symmetric matrix of 3x3 blocks over the particles of a grid, on the pattern of the cloth's
/// elements: a particle meets its eight neighbours and the second next along both grid lines.
/// Vectors are interleaved: x, y, z of particle 0, of particle 1, ...
class GridMatrix {
 public:
  static constexpr int slots = 7;

  explicit GridMatrix(const GridSpec& grid);

  void set_zero();
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
  /// Whether particle j has a neighbour at that slot.
  [[nodiscard]] bool has(int j, int slot) const;

 private:
  [[nodiscard]] std::size_t slot(int j, int step) const {
    return static_cast<std::size_t>(j) * slots + slot_of_step(j, step);
  }
  [[nodiscard]] int slot_of_step(int j, int step) const;

  GridSpec grid_;
  std::array<int, slots> steps_{};
  std::vector<Eigen::Matrix3d> blocks_;
};

/// Cholesky factor of a GridMatrix by the multifrontal method (Duff and Reid 1983) on the grid's
/// nested dissection (George 1973) with separators two lines wide, what the second neighbours ask
/// for. The order and the structure are found once; every sum has a fixed order, so the result
/// does not depend on the number of threads.
class GridFactor {
 public:
  GridFactor(const GridSpec& grid, int threads);
  ~GridFactor();
  GridFactor(GridFactor&&) noexcept;
  GridFactor& operator=(GridFactor&&) noexcept;

  /// False when the matrix plus diag(shift) (one value per particle) is not positive definite.
  [[nodiscard]] bool factorise(const GridMatrix& matrix, const std::vector<double>& shift);
  /// Solves in place with the last factor.
  void solve(Eigen::VectorXd& b) const;
  [[nodiscard]] std::size_t stored_values() const;

 private:
  struct Stack;
  struct Node;
  struct Workspace;
  int build(int row0, int row1, int col0, int col1);
  void find_structure();
  void plan_memory(int node, int level, int workers, int workspace);
  void factor_subtree(int node, int depth, int workspace);
  void factor_node(int node, int workspace);
  void solve_down(int node, int depth, const Eigen::VectorXd& b) const;
  void solve_up(int node, int parent, int depth, Eigen::VectorXd& b) const;
  [[nodiscard]] int depth_of_threads() const;
  static void join_runs(Node& child, const std::vector<int>& place);
  void list_entries(const GridMatrix& pattern, Node& node);
  template <class Use>
  static void for_each_column(const Node& child, const Use& use);
  static void add_to_own(const Node& child, Node& node);
  static void add_to_border(const Node& child, Node& node);
  void assemble(Node& node);

  GridSpec grid_;
  int threads_ = 1;
  std::vector<Node> nodes_;            ///< children before their parent
  std::vector<Workspace> workspaces_;  ///< one per thread
  std::vector<int> rank_;              ///< place in the order of elimination, per particle
  const GridMatrix* matrix_ = nullptr;
  const std::vector<double>* shift_ = nullptr;
  mutable std::vector<Eigen::VectorXd> work_;
};

}  // namespace drape::sim
