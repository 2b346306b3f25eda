// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "simulate/sparse/dense.hpp"

namespace drape::simulate {

/// Symmetric matrix of 3x3 blocks on the vertices and edges of a graph; stores the lower triangle.
class GraphMatrix {
 public:
  /// `neighbours` of each vertex, sorted, in both directions, without itself.
  explicit GraphMatrix(std::vector<std::vector<int>> neighbours);

  [[nodiscard]] int count() const { return static_cast<int>(neighbours_.size()); }
  [[nodiscard]] const std::vector<int>& neighbours(int vertex) const { return neighbours_[vertex]; }
  void set_zero();
  /// Index of the block at (row vertex i, column vertex j), i >= j, which are adjacent or equal.
  [[nodiscard]] int place(int i, int j) const;
  [[nodiscard]] Eigen::Matrix3d& block(int place) { return blocks_[place]; }
  [[nodiscard]] const Eigen::Matrix3d& block(int place) const { return blocks_[place]; }

 private:
  std::vector<std::vector<int>> neighbours_, rows_;  ///< rows by column, starting at the diagonal
  std::vector<int> begin_;                           ///< index of each column's first block
  std::vector<Eigen::Matrix3d> blocks_;
};

/// Cholesky factor of a GraphMatrix by the multifrontal method (Duff and Reid 1983) with nested
/// dissection (George 1973) by positions in the plane: each part is divided by the straight line
/// that halves it with the smallest separator. In single precision, since it preconditions a
/// descent whose forces are in double. Single-threaded; every sum has a fixed order.
class GraphFactor {
 public:
  /// `places` of the vertices: neighbours should be close to each other.
  GraphFactor(const GraphMatrix& pattern, const std::vector<Eigen::Vector2d>& places);

  /// Returns false if the matrix is not positive definite. It must have the same pattern.
  [[nodiscard]] bool factorise(const GraphMatrix& matrix);
  /// Solves in place with the last factor.
  void solve(std::vector<Eigen::Vector3d>& b) const;

 private:
  /// A block of the matrix with its position in its front.
  struct Entry {
    int place = 0, row = 0, col = 0;
    bool transposed = false;
  };
  /// A region of the dissection: its own vertices are eliminated here, its border later.
  struct Front {
    std::vector<int> own, border, children;
    std::vector<Entry> entries;
    std::vector<std::vector<int>>
        in_parent;  ///< for each child, positions of its border among own + border
    std::ptrdiff_t rows = 0, cols = 0;  ///< number of values of own + border, and of own
    std::vector<float> lower, update;   ///< the factor; the update of the border's matrix
  };
  class Dissection;
  static void add_children(std::vector<Front>& fronts, Front& front, bool to_own);

  std::vector<Front> fronts_;  ///< children come before their parent
  DenseScratch scratch_;
  mutable std::vector<Eigen::VectorXf> work_;  ///< one per front
};

}  // namespace drape::simulate
