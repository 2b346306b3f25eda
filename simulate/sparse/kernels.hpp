// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace drape::simulate {

/// Vector instruction sets in ascending order.
enum class Instructions { plain, avx2, avx512 };

/// Inner loops of the dense parts of graph_factor.hpp. All versions add in the same order and round
/// once per product (fused multiply-add), so all give the same bytes.
struct DenseKernels {
  static constexpr std::ptrdiff_t lanes = 64 / sizeof(float);  ///< partial sums of a dot product
  static constexpr std::ptrdiff_t tile_rows = 3 * lanes, tile_cols = 8, dots = 8;

  /// Destination of a product: a column-major tile of `height` x `width`.
  struct Tile {
    float* to = nullptr;
    std::ptrdiff_t lead = 0, height = 0, width = 0;
    bool set = false;  ///< set to the negative product instead of subtracting
  };
  /// Subtracts the sum over k < depth of wide(:, k) narrow(:, k)^T, at most tile_rows x tile_cols,
  /// from the tile. Both operands are strips of tile_rows values per k, and may start inside one:
  /// wide at a multiple of `lanes`, with the tile's height within the strip.
  void (*subtract_product)(const float* wide, const float* narrow, std::ptrdiff_t depth,
                           const Tile& tile);
  /// Subtracts `count` columns of the panel (leading dimension `lead`), each times its factor, from
  /// a column of `rows` values; factors are `step` values apart.
  void (*subtract)(float* column, const float* panel, std::ptrdiff_t lead, const float* factors,
                   std::ptrdiff_t step, std::ptrdiff_t count, std::ptrdiff_t rows);
  /// result[k] = dot product of column k of the panel and `vector`, for `count` <= `dots` columns,
  /// in `lanes` partial sums.
  void (*dot)(const float* panel, std::ptrdiff_t lead, const float* vector, std::ptrdiff_t rows,
              std::ptrdiff_t count, float* result);
};

/// Best instruction set of this processor.
[[nodiscard]] Instructions best_instructions();
/// Kernels for this processor, limited to `most`.
[[nodiscard]] const DenseKernels& dense_kernels(Instructions most);

}  // namespace drape::simulate
