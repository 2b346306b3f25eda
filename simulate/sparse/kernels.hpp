// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace drape::simulate {

/// Vector instructions of a processor, each more than the one before.
enum class Instructions { plain, avx2, avx512 };

/// The inner loops of dense.hpp. Every form adds in the same order and rounds once per product
/// (fused multiply-add), so all give the same bytes.
struct DenseKernels {
  static constexpr std::ptrdiff_t lanes = 64 / sizeof(float);  ///< partial sums of a dot product
  static constexpr std::ptrdiff_t tile_rows = 3 * lanes, tile_cols = 8, dots = 8;

  /// Destination of a tile of a product: column-major, `height` x `width` of it.
  struct Tile {
    float* to = nullptr;
    std::ptrdiff_t lead = 0, height = 0, width = 0;
    bool set = false;  ///< to minus the product, whatever was there
  };
  /// Takes the sum over k < depth of wide(:, k) narrow(:, k)^T, at most tile_rows x tile_cols, off
  /// the tile; both are strips of tile_rows values for each k. Both begin within one: wide at a
  /// multiple of `lanes`, the tile's height not beyond the strip's.
  void (*subtract_product)(const float* wide, const float* narrow, std::ptrdiff_t depth,
                           const Tile& tile);
  /// to += from, `count` values that do not overlap.
  void (*add)(float* to, const float* from, std::ptrdiff_t count);
  /// column (`rows` values) minus `count` columns of the panel (leading dimension `lead`), each
  /// times its factor; factors lie `step` values apart.
  void (*subtract)(float* column, const float* panel, std::ptrdiff_t lead, const float* factors,
                   std::ptrdiff_t step, std::ptrdiff_t count, std::ptrdiff_t rows);
  /// result[k] = column k of the panel times `vector`, for `count` columns, at most `dots`, in
  /// `lanes` partial sums.
  void (*dot)(const float* panel, std::ptrdiff_t lead, const float* vector, std::ptrdiff_t rows,
              std::ptrdiff_t count, float* result);
};

/// Instructions that this processor has.
[[nodiscard]] Instructions best_instructions();
/// The kernels for this processor, with no more than `most`.
[[nodiscard]] const DenseKernels& dense_kernels(Instructions most);

}  // namespace drape::simulate
