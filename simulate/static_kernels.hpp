// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace drape::sim {

/// Vector instructions of a processor, each more than the one before.
enum class Instructions { plain, avx2, avx512 };

/// The inner loops of static_dense. Every form adds in the same order and rounds once per product
/// (fused multiply-add), so all give the same bytes.
struct DenseKernels {
  static constexpr std::ptrdiff_t tile_rows = 24, tile_cols = 8, dots = 8;

  /// tile (tile_rows x tile_cols, column-major) = sum over k < depth of wide(:, k) narrow(:, k)^T;
  /// both are strips of tile_rows values for each k, narrow begins within one.
  void (*multiply)(const double* wide, const double* narrow, std::ptrdiff_t depth, double* tile);
  /// column (`rows` values) minus `count` columns of the panel (leading dimension `lead`), each
  /// times its factor; factors lie `step` values apart.
  void (*subtract)(double* column, const double* panel, std::ptrdiff_t lead, const double* factors,
                   std::ptrdiff_t step, std::ptrdiff_t count, std::ptrdiff_t rows);
  /// result[k] = column k of the panel times `vector`, for `dots` columns, in eight partial sums.
  void (*dot)(const double* panel, std::ptrdiff_t lead, const double* vector, std::ptrdiff_t rows,
              double* result);
};

/// What this processor has.
[[nodiscard]] Instructions best_instructions();
/// The kernels for this processor, with no more than `most`.
[[nodiscard]] const DenseKernels& dense_kernels(Instructions most);

}  // namespace drape::sim
