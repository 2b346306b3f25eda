// SPDX-License-Identifier: Apache-2.0
#include "simulate/static_dense.hpp"

#include <algorithm>
#include <cmath>

#if defined(__GNUC__) && defined(__x86_64__)
#include <immintrin.h>
#define DRAPE_FUSED_X86 1
#else
#define DRAPE_FUSED_X86 0
#endif

namespace drape::sim {
namespace {

using Index = std::ptrdiff_t;

constexpr Index kRows = 12;   // of a tile that stays in registers
constexpr Index kCols = 4;    // the same
constexpr Index kPanel = 24;  // columns factored one by one before the rest is updated

/// Strips of 12 rows, each stored column by column; zeros fill the last strip.
void pack(const double* a, Index lead, Index rows, Index depth, std::vector<double>& packed) {
  constexpr Index height = kRows;
  const Index strips = (rows + height - 1) / height;
  packed.resize(std::max<std::size_t>(packed.size(), strips * height * depth));
  for (Index s = 0; s < strips; ++s) {
    double* to = packed.data() + s * height * depth;
    const Index count = std::min(height, rows - s * height);
    for (Index k = 0; k < depth; ++k) {
      const double* from = a + s * height + k * lead;
      for (Index r = 0; r < count; ++r) to[k * height + r] = from[r];
      for (Index r = count; r < height; ++r) to[k * height + r] = 0;
    }
  }
}

/// tile (12 x 4, column-major) = sum over k of wide(:, k) narrow(:, k)^T; narrow is a part of a
/// strip.
void multiply_strips(const double* wide, const double* narrow, Index depth, double* tile) {
  std::fill(tile, tile + kRows * kCols, 0.0);
  for (Index k = 0; k < depth; ++k) {
    for (Index c = 0; c < kCols; ++c) {
      const double b = narrow[k * kRows + c];
      for (Index r = 0; r < kRows; ++r) {
        tile[c * kRows + r] = std::fma(wide[k * kRows + r], b, tile[c * kRows + r]);
      }
    }
  }
}

/// column -= columns before it in the panel, each times its entry in `row`.
void subtract_columns(double* column, const double* panel, Index lead, const double* row,
                      Index count, Index rows) {
  for (Index k = 0; k < count; ++k) {
    const double b = -row[k * lead];
    for (Index r = 0; r < rows; ++r) column[r] = std::fma(panel[k * lead + r], b, column[r]);
  }
}

#if DRAPE_FUSED_X86
#define DRAPE_FUSED __attribute__((target("avx2,fma")))
constexpr Index kLane = 4;
constexpr Index kLanes = kRows / kLane;

DRAPE_FUSED
void multiply_strips_x86(const double* wide, const double* narrow, Index depth, double* tile) {
  __m256d sum[kCols][kLanes] = {};
  for (Index k = 0; k < depth; ++k) {
    __m256d a[kLanes];
    for (Index l = 0; l < kLanes; ++l) a[l] = _mm256_loadu_pd(wide + k * kRows + l * kLane);
    for (Index c = 0; c < kCols; ++c) {
      const __m256d b = _mm256_set1_pd(narrow[k * kRows + c]);
      for (Index l = 0; l < kLanes; ++l) sum[c][l] = _mm256_fmadd_pd(a[l], b, sum[c][l]);
    }
  }
  for (Index c = 0; c < kCols; ++c) {
    for (Index l = 0; l < kLanes; ++l) _mm256_storeu_pd(tile + c * kRows + l * kLane, sum[c][l]);
  }
}

DRAPE_FUSED
void subtract_columns_x86(double* column, const double* panel, Index lead, const double* row,
                          Index count, Index rows) {
  Index r = 0;
  for (; r + kRows <= rows; r += kRows) {
    __m256d sum[kLanes];
    for (Index l = 0; l < kLanes; ++l) sum[l] = _mm256_loadu_pd(column + r + l * kLane);
    for (Index k = 0; k < count; ++k) {
      const __m256d b = _mm256_set1_pd(-row[k * lead]);
      const double* from = panel + k * lead + r;
      for (Index l = 0; l < kLanes; ++l) {
        sum[l] = _mm256_fmadd_pd(_mm256_loadu_pd(from + l * kLane), b, sum[l]);
      }
    }
    for (Index l = 0; l < kLanes; ++l) _mm256_storeu_pd(column + r + l * kLane, sum[l]);
  }
  for (; r < rows; ++r) {
    double sum = column[r];
    for (Index k = 0; k < count; ++k) sum = std::fma(panel[k * lead + r], -row[k * lead], sum);
    column[r] = sum;
  }
}
#endif

/// The kernels, chosen once: what they add, they add in one order with one rounding per product
/// (fused multiply-add), so both forms give the same bytes.
struct Kernels {
  void (*multiply)(const double*, const double*, Index, double*) = multiply_strips;
  void (*subtract)(double*, const double*, Index, const double*, Index, Index) = subtract_columns;

  explicit Kernels(bool plain) {
#if DRAPE_FUSED_X86
    if (plain || !__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return;
    multiply = multiply_strips_x86;
    subtract = subtract_columns_x86;
#else
    static_cast<void>(plain);
#endif
  }
};

const Kernels& kernels(bool plain) {
  static const Kernels fast(false);
  static const Kernels portable(true);
  return plain ? portable : fast;
}

/// Calls `use` with every tile of A A^T that meets the lower triangle of its first `cols` columns.
template <class Use>
void for_each_tile(const double* a, Index a_lead, Index rows, Index cols, Index depth,
                   DenseScratch& scratch, const Use& use) {
  pack(a, a_lead, rows, depth, scratch.strips);
  const Kernels& run = kernels(scratch.portable);
  double tile[kRows * kCols];
  for (Index j = 0; j < cols; j += kCols) {
    const Index width = std::min(kCols, cols - j);
    const double* narrow = scratch.strips.data() + (j - j % kRows) * depth + j % kRows;
    for (Index i = j - j % kRows; i < rows; i += kRows) {
      run.multiply(scratch.strips.data() + i * depth, narrow, depth, tile);
      use(i, j, std::min(kRows, rows - i), width, tile);
    }
  }
}

}  // namespace

void subtract_outer(const double* a, Index a_lead, Index rows, Index cols, Index depth,
                    double* result, Index result_lead, DenseScratch& scratch) {
  for_each_tile(a, a_lead, rows, cols, depth, scratch,
                [&](Index i, Index j, Index height, Index width, const double* tile) {
                  for (Index c = 0; c < width; ++c) {
                    double* to = result + i + (j + c) * result_lead;
                    for (Index r = 0; r < height; ++r) to[r] -= tile[c * kRows + r];
                  }
                });
}

void set_minus_outer(const double* a, Index a_lead, Index rows, Index depth, double* result,
                     DenseScratch& scratch) {
  for_each_tile(a, a_lead, rows, rows, depth, scratch,
                [&](Index i, Index j, Index height, Index width, const double* tile) {
                  for (Index c = 0; c < width; ++c) {
                    double* to = result + i + (j + c) * rows;
                    for (Index r = 0; r < height; ++r) to[r] = -tile[c * kRows + r];
                  }
                });
}

bool factor_columns(double* matrix, Index rows, Index cols, DenseScratch& scratch) {
  const Kernels& run = kernels(scratch.portable);
  for (Index first = 0; first < cols; first += kPanel) {
    const Index last = std::min(cols, first + kPanel);
    for (Index c = first; c < last; ++c) {
      double* column = matrix + c * rows + c;
      run.subtract(column, matrix + first * rows + c, rows, matrix + first * rows + c, c - first,
                   rows - c);
      if (!(column[0] > 0)) return false;
      const double pivot = std::sqrt(column[0]);
      const double inverse = 1 / pivot;
      column[0] = pivot;
      for (Index r = 1; r < rows - c; ++r) column[r] *= inverse;
    }
    subtract_outer(matrix + first * rows + last, rows, rows - last, cols - last, last - first,
                   matrix + last * rows + last, rows, scratch);
  }
  return true;
}

}  // namespace drape::sim
