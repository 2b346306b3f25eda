// SPDX-License-Identifier: Apache-2.0
#include "simulate/static_kernels.hpp"

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

constexpr Index kRows = DenseKernels::tile_rows;
constexpr Index kCols = DenseKernels::tile_cols;
constexpr Index kDots = DenseKernels::dots;
constexpr Index kLanes = 8;  // of a dot product's sums

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

void subtract_columns(double* column, const double* panel, Index lead, const double* factors,
                      Index step, Index count, Index rows) {
  for (Index k = 0; k < count; ++k) {
    const double b = -factors[k * step];
    for (Index r = 0; r < rows; ++r) column[r] = std::fma(panel[k * lead + r], b, column[r]);
  }
}

/// Sum of eight lanes, in one order.
double sum_of(const double* lanes) {
  return ((lanes[0] + lanes[4]) + (lanes[1] + lanes[5])) +
         ((lanes[2] + lanes[6]) + (lanes[3] + lanes[7]));
}

void dot_columns(const double* panel, Index lead, const double* vector, Index rows, double* dots) {
  for (Index k = 0; k < kDots; ++k) {
    double lanes[kLanes] = {};
    for (Index r = 0; r < rows; ++r) {
      lanes[r % kLanes] = std::fma(panel[k * lead + r], vector[r], lanes[r % kLanes]);
    }
    dots[k] = sum_of(lanes);
  }
}

#if DRAPE_FUSED_X86
#define DRAPE_AVX2 __attribute__((target("avx2,fma")))
#define DRAPE_AVX512 __attribute__((target("avx512f")))

/// A quarter of a tile: 12 x 4 sums fill the sixteen registers.
DRAPE_AVX2
void multiply_quarter(const double* wide, const double* narrow, Index depth, double* tile) {
  __m256d sum[4][3] = {};
  for (Index k = 0; k < depth; ++k) {
    __m256d a[3];
    for (Index l = 0; l < 3; ++l) a[l] = _mm256_loadu_pd(wide + k * kRows + l * 4);
    for (Index c = 0; c < 4; ++c) {
      const __m256d b = _mm256_set1_pd(narrow[k * kRows + c]);
      for (Index l = 0; l < 3; ++l) sum[c][l] = _mm256_fmadd_pd(a[l], b, sum[c][l]);
    }
  }
  for (Index c = 0; c < 4; ++c) {
    for (Index l = 0; l < 3; ++l) _mm256_storeu_pd(tile + c * kRows + l * 4, sum[c][l]);
  }
}

DRAPE_AVX2
void multiply_strips_avx2(const double* wide, const double* narrow, Index depth, double* tile) {
  for (Index c = 0; c < kCols; c += 4) {
    for (Index r = 0; r < kRows; r += 12) {
      multiply_quarter(wide + r, narrow + c, depth, tile + c * kRows + r);
    }
  }
}

DRAPE_AVX512
void multiply_strips_avx512(const double* wide, const double* narrow, Index depth, double* tile) {
  __m512d sum[kCols][3] = {};
  for (Index k = 0; k < depth; ++k) {
    __m512d a[3];
    for (Index l = 0; l < 3; ++l) a[l] = _mm512_loadu_pd(wide + k * kRows + l * 8);
    for (Index c = 0; c < kCols; ++c) {
      const __m512d b = _mm512_set1_pd(narrow[k * kRows + c]);
      for (Index l = 0; l < 3; ++l) sum[c][l] = _mm512_fmadd_pd(a[l], b, sum[c][l]);
    }
  }
  for (Index c = 0; c < kCols; ++c) {
    for (Index l = 0; l < 3; ++l) _mm512_storeu_pd(tile + c * kRows + l * 8, sum[c][l]);
  }
}

DRAPE_AVX2
void subtract_columns_avx2(double* column, const double* panel, Index lead, const double* factors,
                           Index step, Index count, Index rows) {
  Index r = 0;
  for (; r + 12 <= rows; r += 12) {
    __m256d sum[3];
    for (Index l = 0; l < 3; ++l) sum[l] = _mm256_loadu_pd(column + r + l * 4);
    for (Index k = 0; k < count; ++k) {
      const __m256d b = _mm256_set1_pd(-factors[k * step]);
      const double* from = panel + k * lead + r;
      for (Index l = 0; l < 3; ++l) {
        sum[l] = _mm256_fmadd_pd(_mm256_loadu_pd(from + l * 4), b, sum[l]);
      }
    }
    for (Index l = 0; l < 3; ++l) _mm256_storeu_pd(column + r + l * 4, sum[l]);
  }
  for (; r < rows; ++r) {
    double sum = column[r];
    for (Index k = 0; k < count; ++k) sum = std::fma(panel[k * lead + r], -factors[k * step], sum);
    column[r] = sum;
  }
}

DRAPE_AVX512
void subtract_columns_avx512(double* column, const double* panel, Index lead, const double* factors,
                             Index step, Index count, Index rows) {
  Index r = 0;
  for (; r + 32 <= rows; r += 32) {
    __m512d sum[4];
    for (Index l = 0; l < 4; ++l) sum[l] = _mm512_loadu_pd(column + r + l * 8);
    for (Index k = 0; k < count; ++k) {
      const __m512d b = _mm512_set1_pd(-factors[k * step]);
      const double* from = panel + k * lead + r;
      for (Index l = 0; l < 4; ++l) {
        sum[l] = _mm512_fmadd_pd(_mm512_loadu_pd(from + l * 8), b, sum[l]);
      }
    }
    for (Index l = 0; l < 4; ++l) _mm512_storeu_pd(column + r + l * 8, sum[l]);
  }
  for (; r < rows; r += 8) {
    const __mmask8 in = static_cast<__mmask8>((1U << std::min<Index>(8, rows - r)) - 1U);
    __m512d sum = _mm512_maskz_loadu_pd(in, column + r);
    for (Index k = 0; k < count; ++k) {
      const __m512d b = _mm512_set1_pd(-factors[k * step]);
      sum = _mm512_fmadd_pd(_mm512_maskz_loadu_pd(in, panel + k * lead + r), b, sum);
    }
    _mm512_mask_storeu_pd(column + r, in, sum);
  }
}

DRAPE_AVX2
void dot_columns_avx2(const double* panel, Index lead, const double* vector, Index rows,
                      double* dots) {
  for (Index k = 0; k < kDots; k += 4) {
    __m256d sum[4][2] = {};
    const double* from = panel + k * lead;
    Index r = 0;
    for (; r + kLanes <= rows; r += kLanes) {
      const __m256d low = _mm256_loadu_pd(vector + r);
      const __m256d high = _mm256_loadu_pd(vector + r + 4);
      for (Index c = 0; c < 4; ++c) {
        sum[c][0] = _mm256_fmadd_pd(_mm256_loadu_pd(from + c * lead + r), low, sum[c][0]);
        sum[c][1] = _mm256_fmadd_pd(_mm256_loadu_pd(from + c * lead + r + 4), high, sum[c][1]);
      }
    }
    for (Index c = 0; c < 4; ++c) {
      double lanes[kLanes];
      _mm256_storeu_pd(lanes, sum[c][0]);
      _mm256_storeu_pd(lanes + 4, sum[c][1]);
      for (Index q = r; q < rows; ++q) {
        lanes[q - r] = std::fma(from[c * lead + q], vector[q], lanes[q - r]);
      }
      dots[k + c] = sum_of(lanes);
    }
  }
}

DRAPE_AVX512
void dot_columns_avx512(const double* panel, Index lead, const double* vector, Index rows,
                        double* dots) {
  __m512d sum[kDots] = {};
  for (Index r = 0; r < rows; r += kLanes) {
    const auto in = static_cast<__mmask8>((1U << std::min(kLanes, rows - r)) - 1U);
    const __m512d v = _mm512_maskz_loadu_pd(in, vector + r);
    for (Index c = 0; c < kDots; ++c) {
      sum[c] = _mm512_fmadd_pd(_mm512_maskz_loadu_pd(in, panel + c * lead + r), v, sum[c]);
    }
  }
  for (Index c = 0; c < kDots; ++c) {
    double lanes[kLanes];
    _mm512_storeu_pd(lanes, sum[c]);
    dots[c] = sum_of(lanes);
  }
}
#endif

#if DRAPE_FUSED_X86
constexpr DenseKernels kAvx512{multiply_strips_avx512, subtract_columns_avx512, dot_columns_avx512};
constexpr DenseKernels kAvx2{multiply_strips_avx2, subtract_columns_avx2, dot_columns_avx2};
#endif
constexpr DenseKernels kPlain{multiply_strips, subtract_columns, dot_columns};

}  // namespace

Instructions best_instructions() {
#if DRAPE_FUSED_X86
  if (__builtin_cpu_supports("avx512f")) return Instructions::avx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return Instructions::avx2;
#endif
  return Instructions::plain;
}

const DenseKernels& dense_kernels(Instructions most) {
  static const Instructions best = best_instructions();
#if DRAPE_FUSED_X86
  switch (std::min(most, best)) {
    case Instructions::avx512:
      return kAvx512;
    case Instructions::avx2:
      return kAvx2;
    case Instructions::plain:
      break;
  }
#else
  static_cast<void>(most);
#endif
  return kPlain;
}

}  // namespace drape::sim
