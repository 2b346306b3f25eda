// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "simulate/sparse/kernels.hpp"

namespace drape::simulate {

/// Offset of a column in the trapezoid format: the first columns of a lower triangle are stored in
/// blocks of 48, the height of a tile, each column-major from the row of its first column: value
/// (i, j) is at trapezoid_column(rows, j) + i, for i >= j - j % width.
constexpr std::ptrdiff_t trapezoid_column(std::ptrdiff_t rows, std::ptrdiff_t j) {
  constexpr std::ptrdiff_t width = DenseKernels::tile_rows;
  const std::ptrdiff_t block = j / width;
  const std::ptrdiff_t before = width * block * rows - width * width * block * (block - 1) / 2;
  return before + (j % width) * (rows - width * block) - width * block;
}
/// Number of values of `cols` such columns.
constexpr std::ptrdiff_t trapezoid_size(std::ptrdiff_t rows, std::ptrdiff_t cols) {
  return cols > 0 ? trapezoid_column(rows, cols - 1) + rows : 0;
}

/// Scratch of the dense kernels, kept between calls.
struct DenseScratch {
  std::vector<float> strips;
  Instructions most = Instructions::avx512;  ///< best instruction set to use, if available
};

/// Cholesky-factorises the first `cols` columns of a symmetric matrix in place: the block on top
/// becomes the factor with inverted diagonal, and the rows below are solved with it. Returns false
/// if a pivot is not positive. Gives the same bytes on every processor: products are added one by
/// one in a fixed order, vectorised across rows. Values above the diagonal are overwritten.
[[nodiscard]] bool factor_columns(float* trapezoid, std::ptrdiff_t rows, std::ptrdiff_t cols,
                                  DenseScratch& scratch);

/// Writes -A A^T, with A the rows below the first `cols` of a factor, into `triangle`, all columns
/// of a lower triangle of size rows - cols, including two or more rows above the diagonal.
void set_minus_outer(const float* trapezoid, std::ptrdiff_t rows, std::ptrdiff_t cols,
                     float* triangle, DenseScratch& scratch);

/// Forward substitution in place on x of `rows` values: solves the first `cols` with the triangle
/// of a factor by factor_columns(), and subtracts their products with the rows below it.
void solve_columns(const float* trapezoid, std::ptrdiff_t rows, std::ptrdiff_t cols, float* x,
                   Instructions most = Instructions::avx512);

/// Backward substitution with the transposed factor: the first `cols` of x, given the rest.
void solve_columns_transposed(const float* trapezoid, std::ptrdiff_t rows, std::ptrdiff_t cols,
                              float* x, Instructions most = Instructions::avx512);

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
/// dissection (George 1973) by positions in the plane: the straight line with the smallest
/// separator halves each part. Single precision suffices, since it preconditions a descent whose
/// forces are in double. Single-threaded; every sum has a fixed order.
class GraphFactor {
 public:
  /// `places`: positions of the vertices; neighbours should be close to each other.
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
