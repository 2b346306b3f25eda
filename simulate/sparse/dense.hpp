// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "simulate/sparse/kernels.hpp"

namespace drape::simulate {

/// The first columns of a lower triangle are stored in blocks of 48, as wide as a tile is
/// high, each block column-major from the row of its first column on: value (i, j)
/// lies at trapezoid_column(rows, j) + i, for i from j - j % width.
constexpr std::ptrdiff_t trapezoid_column(std::ptrdiff_t rows, std::ptrdiff_t j) {
  constexpr std::ptrdiff_t width = DenseKernels::tile_rows;
  const std::ptrdiff_t block = j / width;
  const std::ptrdiff_t before = width * block * rows - width * width * block * (block - 1) / 2;
  return before + (j % width) * (rows - width * block) - width * block;
}
/// Values of `cols` such columns.
constexpr std::ptrdiff_t trapezoid_size(std::ptrdiff_t rows, std::ptrdiff_t cols) {
  return cols > 0 ? trapezoid_column(rows, cols - 1) + rows : 0;
}

/// Scratch of the dense kernels, kept between calls.
struct DenseScratch {
  std::vector<float> strips;
  Instructions most = Instructions::avx512;  ///< to use where the processor has them
};

/// Cholesky factor of a symmetric matrix's first `cols` columns, in place: the triangle on top
/// becomes the factor, its diagonal inverted, the rows below are solved with it. False when a pivot
/// is not positive. The same bytes on every processor: products are added one by one in a fixed
/// order, in vectors across rows. What is stored above the diagonal is changed too.
[[nodiscard]] bool factor_columns(float* trapezoid, std::ptrdiff_t rows, std::ptrdiff_t cols,
                                  DenseScratch& scratch);

/// Writes minus A A^T, A the rows below the first `cols` of a factor, into `triangle`, all columns
/// of a lower triangle of rows - cols, from two rows above the diagonal on at the latest.
void set_minus_outer(const float* trapezoid, std::ptrdiff_t rows, std::ptrdiff_t cols,
                     float* triangle, DenseScratch& scratch);

/// x of `rows` values, in place: its first `cols` solved with the triangle of a factor of
/// factor_columns(), the rest less what the rows below make of them.
void solve_columns(const float* trapezoid, std::ptrdiff_t rows, std::ptrdiff_t cols, float* x,
                   Instructions most = Instructions::avx512);

/// The same with the transposed factor: the first `cols` of x from themselves and the rest.
void solve_columns_transposed(const float* trapezoid, std::ptrdiff_t rows, std::ptrdiff_t cols,
                              float* x, Instructions most = Instructions::avx512);

}  // namespace drape::simulate
