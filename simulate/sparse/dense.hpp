// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace drape::simulate
