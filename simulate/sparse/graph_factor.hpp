// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "simulate/sparse/dense.hpp"

namespace drape::simulate {

/// Symmetric matrix of 3x3 blocks over the vertices of any graph; its lower triangle is stored.
class GraphMatrix {
 public:
  /// `neighbours` of each vertex, in both directions, each once and in order, without itself.
  explicit GraphMatrix(std::vector<std::vector<int>> neighbours);

  [[nodiscard]] int count() const { return static_cast<int>(neighbours_.size()); }
  [[nodiscard]] const std::vector<int>& neighbours(int vertex) const { return neighbours_[vertex]; }
  void set_zero();
  /// Place of the block at (row vertex i, column vertex j), i >= j, which are joined or the same.
  [[nodiscard]] int place(int i, int j) const;
  [[nodiscard]] Eigen::Matrix3d& block(int place) { return blocks_[place]; }
  [[nodiscard]] const Eigen::Matrix3d& block(int place) const { return blocks_[place]; }

 private:
  std::vector<std::vector<int>> neighbours_, rows_;  ///< rows: of each column, from the diagonal on
  std::vector<int> begin_;                           ///< first of a column's blocks
  std::vector<Eigen::Matrix3d> blocks_;
};

/// Cholesky factor of a GraphMatrix by the multifrontal method (Duff and Reid 1983) on a nested
/// dissection (George 1973) by places in the plane: a part is cut by the straight line that halves
/// it with the fewest vertices beside it. In single precision, for it precedes a descent whose
/// forces are in double. One thread; every sum has a fixed order.
class GraphFactor {
 public:
  /// `places` of the vertices: neighbours should lie near each other.
  GraphFactor(const GraphMatrix& pattern, const std::vector<Eigen::Vector2d>& places);

  /// False when the matrix is not positive definite. Its pattern is the constructor's.
  [[nodiscard]] bool factorise(const GraphMatrix& matrix);
  /// Solves in place with the last factor.
  void solve(std::vector<Eigen::Vector3d>& b) const;

 private:
  /// A block of the matrix and where in its front it belongs.
  struct Entry {
    int place = 0, row = 0, col = 0;
    bool transposed = false;
  };
  /// A region of the dissection: its own vertices are eliminated here, its border later.
  struct Front {
    std::vector<int> own, border, children;
    std::vector<Entry> entries;
    std::vector<std::vector<int>>
        in_parent;                      ///< for each child, its border's places among own + border
    std::ptrdiff_t rows = 0, cols = 0;  ///< values of own and border; of own
    std::vector<float> lower, update;   ///< the factor; what the border's matrix loses
  };
  class Dissection;
  static void add_children(std::vector<Front>& fronts, Front& front, bool to_own);

  std::vector<Front> fronts_;  ///< children before their parent
  DenseScratch scratch_;
  mutable std::vector<Eigen::VectorXf> work_;  ///< one for each front
};

}  // namespace drape::simulate
