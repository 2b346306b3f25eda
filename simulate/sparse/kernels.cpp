// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/kernels.hpp"

#include <algorithm>
#include <cmath>

#if defined(__GNUC__) && defined(__x86_64__)
#include <immintrin.h>
#define DRAPE_FUSED_X86 1
#else
#define DRAPE_FUSED_X86 0
#endif

namespace drape::simulate {
namespace {

using Index = std::ptrdiff_t;

template <class Real>
constexpr Index kRows = DenseKernels<Real>::tile_rows;
template <class Real>
constexpr Index kLanes = DenseKernels<Real>::lanes;
constexpr Index kCols = DenseKernels<double>::tile_cols;
constexpr Index kDots = DenseKernels<double>::dots;

template <class Real>
using Tile = typename DenseKernels<Real>::Tile;

/// Writes a product that was formed column by column, kRows values each.
template <class Real>
void subtract_tile(const Real* product, const Tile<Real>& tile) {
  for (Index c = 0; c < tile.width; ++c) {
    Real* to = tile.to + c * tile.lead;
    const Real* from = product + c * kRows<Real>;
    for (Index r = 0; r < tile.height; ++r) to[r] = (tile.set ? Real{0} : to[r]) - from[r];
  }
}

template <class Real>
void subtract_product(const Real* wide, const Real* narrow, Index depth, const Tile<Real>& tile) {
  constexpr Index rows = kRows<Real>;
  Real product[rows * kCols] = {};
  for (Index k = 0; k < depth; ++k) {
    for (Index c = 0; c < kCols; ++c) {
      const Real b = narrow[k * rows + c];
      for (Index r = 0; r < tile.height; ++r) {
        product[c * rows + r] = std::fma(wide[k * rows + r], b, product[c * rows + r]);
      }
    }
  }
  subtract_tile(product, tile);
}

template <class Real>
void add(Real* to, const Real* from, Index count) {
  for (Index r = 0; r < count; ++r) to[r] += from[r];
}

template <class Real>
void subtract_columns(Real* column, const Real* panel, Index lead, const Real* factors, Index step,
                      Index count, Index rows) {
  for (Index k = 0; k < count; ++k) {
    const Real b = -factors[k * step];
    for (Index r = 0; r < rows; ++r) column[r] = std::fma(panel[k * lead + r], b, column[r]);
  }
}

/// Sum of the lanes, in one order: halves on each other, down to one.
template <class Real>
Real sum_of(Real* lanes) {
  for (Index half = kLanes<Real> / 2; half > 0; half /= 2) {
    for (Index k = 0; k < half; ++k) lanes[k] += lanes[k + half];
  }
  return lanes[0];
}

template <class Real>
void dot_columns(const Real* panel, Index lead, const Real* vector, Index rows, Index count,
                 Real* dots) {
  for (Index k = 0; k < count; ++k) {
    Real lanes[kLanes<Real>] = {};
    for (Index r = 0; r < rows; ++r) {
      Real& lane = lanes[r % kLanes<Real>];
      lane = std::fma(panel[k * lead + r], vector[r], lane);
    }
    dots[k] = sum_of(lanes);
  }
}

#if DRAPE_FUSED_X86
#define DRAPE_AVX2 __attribute__((target("avx2,fma")))
#define DRAPE_AVX512 __attribute__((target("avx512f")))

template <class Real>
struct Vectors;
template <>
struct Vectors<double> {
  using Avx2 = __m256d;
  using Avx512 = __m512d;
};
template <>
struct Vectors<float> {
  using Avx2 = __m256;
  using Avx512 = __m512;
};

// The instructions by one name for both precisions.
DRAPE_AVX2 inline __m256d load2(const double* p) {
  return _mm256_loadu_pd(p);
}
DRAPE_AVX2 inline __m256 load2(const float* p) {
  return _mm256_loadu_ps(p);
}
DRAPE_AVX2 inline __m256d all2(double x) {
  return _mm256_set1_pd(x);
}
DRAPE_AVX2 inline __m256 all2(float x) {
  return _mm256_set1_ps(x);
}
DRAPE_AVX2 inline void store2(double* p, __m256d v) {
  _mm256_storeu_pd(p, v);
}
DRAPE_AVX2 inline void store2(float* p, __m256 v) {
  _mm256_storeu_ps(p, v);
}
DRAPE_AVX2 inline __m256d fma2(__m256d a, __m256d b, __m256d c) {
  return _mm256_fmadd_pd(a, b, c);
}
DRAPE_AVX2 inline __m256 fma2(__m256 a, __m256 b, __m256 c) {
  return _mm256_fmadd_ps(a, b, c);
}
DRAPE_AVX2 inline __m256d add2(__m256d a, __m256d b) {
  return _mm256_add_pd(a, b);
}
DRAPE_AVX2 inline __m256 add2(__m256 a, __m256 b) {
  return _mm256_add_ps(a, b);
}

DRAPE_AVX512 inline __m512d load5(const double* p) {
  return _mm512_loadu_pd(p);
}
DRAPE_AVX512 inline __m512 load5(const float* p) {
  return _mm512_loadu_ps(p);
}
DRAPE_AVX512 inline __m512d all5(double x) {
  return _mm512_set1_pd(x);
}
DRAPE_AVX512 inline __m512 all5(float x) {
  return _mm512_set1_ps(x);
}
DRAPE_AVX512 inline void store5(double* p, __m512d v) {
  _mm512_storeu_pd(p, v);
}
DRAPE_AVX512 inline void store5(float* p, __m512 v) {
  _mm512_storeu_ps(p, v);
}
DRAPE_AVX512 inline __m512d fma5(__m512d a, __m512d b, __m512d c) {
  return _mm512_fmadd_pd(a, b, c);
}
DRAPE_AVX512 inline __m512 fma5(__m512 a, __m512 b, __m512 c) {
  return _mm512_fmadd_ps(a, b, c);
}
DRAPE_AVX512 inline __m512d add5(__m512d a, __m512d b) {
  return _mm512_add_pd(a, b);
}
DRAPE_AVX512 inline __m512 add5(__m512 a, __m512 b) {
  return _mm512_add_ps(a, b);
}
DRAPE_AVX512 inline __m512d sub5(__m512d a, __m512d b) {
  return _mm512_sub_pd(a, b);
}
DRAPE_AVX512 inline __m512 sub5(__m512 a, __m512 b) {
  return _mm512_sub_ps(a, b);
}
/// Sum of the lanes in the order of sum_of().
DRAPE_AVX512 inline double sum5(__m512d v) {
  const auto four =
      __builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7);
  const auto two =
      __builtin_shufflevector(four, four, 0, 1) + __builtin_shufflevector(four, four, 2, 3);
  return two[0] + two[1];
}
DRAPE_AVX512 inline float sum5(__m512 v) {
  const auto eight = __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7) +
                     __builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15);
  const auto four = __builtin_shufflevector(eight, eight, 0, 1, 2, 3) +
                    __builtin_shufflevector(eight, eight, 4, 5, 6, 7);
  const auto two =
      __builtin_shufflevector(four, four, 0, 1) + __builtin_shufflevector(four, four, 2, 3);
  return two[0] + two[1];
}
/// The first `count` values, zeros behind; more than there are lanes: all.
DRAPE_AVX512 inline __m512d load5(const double* p, Index count) {
  return _mm512_maskz_loadu_pd(static_cast<__mmask8>((1U << std::min<Index>(8, count)) - 1U), p);
}
DRAPE_AVX512 inline __m512 load5(const float* p, Index count) {
  return _mm512_maskz_loadu_ps(static_cast<__mmask16>((1U << std::min<Index>(16, count)) - 1U), p);
}
DRAPE_AVX512 inline void store5(double* p, __m512d v, Index count) {
  _mm512_mask_storeu_pd(p, static_cast<__mmask8>((1U << std::min<Index>(8, count)) - 1U), v);
}
DRAPE_AVX512 inline void store5(float* p, __m512 v, Index count) {
  _mm512_mask_storeu_ps(p, static_cast<__mmask16>((1U << std::min<Index>(16, count)) - 1U), v);
}

// Unrolled early, or the sums pass through memory before and after the loop.

/// A quarter of a tile or less: at most half its rows x 4 sums fill the sixteen registers.
template <Index vectors, class Real>
DRAPE_AVX2 void multiply_quarter(const Real* wide, const Real* narrow, Index depth, Real* tile) {
  constexpr Index rows = kRows<Real>;
  constexpr Index lanes = kLanes<Real> / 2;
  typename Vectors<Real>::Avx2 sum[4][vectors] = {};
  for (Index k = 0; k < depth; ++k) {
    typename Vectors<Real>::Avx2 a[vectors];
#pragma GCC unroll 3
    for (Index l = 0; l < vectors; ++l) a[l] = load2(wide + k * rows + l * lanes);
#pragma GCC unroll 8
    for (Index c = 0; c < 4; ++c) {
      const auto b = all2(narrow[k * rows + c]);
#pragma GCC unroll 3
      for (Index l = 0; l < vectors; ++l) sum[c][l] = fma2(a[l], b, sum[c][l]);
    }
  }
#pragma GCC unroll 8
  for (Index c = 0; c < 4; ++c) {
#pragma GCC unroll 3
    for (Index l = 0; l < vectors; ++l) store2(tile + c * rows + l * lanes, sum[c][l]);
  }
}

template <class Real>
DRAPE_AVX2 void subtract_product_avx2(const Real* wide, const Real* narrow, Index depth,
                                      const Tile<Real>& tile) {
  constexpr Index rows = kRows<Real>;
  constexpr Index lanes = kLanes<Real> / 2;
  Real product[rows * kCols];
  for (Index c = 0; c < kCols; c += 4) {
    for (Index r = 0; r < tile.height; r += rows / 2) {
      const Index left = tile.height - r;
      const auto multiply = left > 2 * lanes ? multiply_quarter<3, Real>
                            : left > lanes   ? multiply_quarter<2, Real>
                                             : multiply_quarter<1, Real>;
      multiply(wide + r, narrow + c, depth, product + c * rows + r);
    }
  }
  subtract_tile(product, tile);
}

template <class Real>
DRAPE_AVX2 void add_avx2(Real* to, const Real* from, Index count) {
  constexpr Index lanes = kLanes<Real> / 2;
  Index r = 0;
  for (; r + lanes <= count; r += lanes) store2(to + r, add2(load2(to + r), load2(from + r)));
  for (; r < count; ++r) to[r] += from[r];
}

/// `vectors` of them hold the tile's height.
template <Index vectors, class Real>
DRAPE_AVX512 void subtract_vectors(const Real* wide, const Real* narrow, Index depth,
                                   const Tile<Real>& tile) {
  constexpr Index rows = kRows<Real>;
  constexpr Index lanes = kLanes<Real>;
  typename Vectors<Real>::Avx512 sum[kCols][vectors] = {};
  for (Index k = 0; k < depth; ++k) {
    typename Vectors<Real>::Avx512 a[vectors];
#pragma GCC unroll 3
    for (Index l = 0; l < vectors; ++l) a[l] = load5(wide + k * rows + l * lanes);
#pragma GCC unroll 8
    for (Index c = 0; c < kCols; ++c) {
      const auto b = all5(narrow[k * rows + c]);
#pragma GCC unroll 3
      for (Index l = 0; l < vectors; ++l) sum[c][l] = fma5(a[l], b, sum[c][l]);
    }
  }
  const typename Vectors<Real>::Avx512 zero = {};
#pragma GCC unroll 8
  for (Index c = 0; c < kCols; ++c) {
    if (c >= tile.width) break;
#pragma GCC unroll 3
    for (Index l = 0; l < vectors; ++l) {
      const Index left = tile.height - l * lanes;
      Real* to = tile.to + c * tile.lead + l * lanes;
      store5(to, sub5(tile.set ? zero : load5(to, left), sum[c][l]), left);
    }
  }
}

template <class Real>
DRAPE_AVX512 void subtract_product_avx512(const Real* wide, const Real* narrow, Index depth,
                                          const Tile<Real>& tile) {
  if (tile.height > 2 * kLanes<Real>) {
    subtract_vectors<3>(wide, narrow, depth, tile);
  } else if (tile.height > kLanes<Real>) {
    subtract_vectors<2>(wide, narrow, depth, tile);
  } else {
    subtract_vectors<1>(wide, narrow, depth, tile);
  }
}

template <class Real>
DRAPE_AVX512 void add_avx512(Real* to, const Real* from, Index count) {
  constexpr Index lanes = kLanes<Real>;
  for (Index r = 0; r < count; r += lanes) {
    const Index left = count - r;
    store5(to + r, add5(load5(to + r, left), load5(from + r, left)), left);
  }
}

template <class Real>
DRAPE_AVX2 void subtract_columns_avx2(Real* column, const Real* panel, Index lead,
                                      const Real* factors, Index step, Index count, Index rows) {
  constexpr Index lanes = kLanes<Real> / 2;
  Index r = 0;
  for (; r + 3 * lanes <= rows; r += 3 * lanes) {
    typename Vectors<Real>::Avx2 sum[3];
    for (Index l = 0; l < 3; ++l) sum[l] = load2(column + r + l * lanes);
    for (Index k = 0; k < count; ++k) {
      const auto b = all2(-factors[k * step]);
      const Real* from = panel + k * lead + r;
      for (Index l = 0; l < 3; ++l) sum[l] = fma2(load2(from + l * lanes), b, sum[l]);
    }
    for (Index l = 0; l < 3; ++l) store2(column + r + l * lanes, sum[l]);
  }
  for (; r < rows; ++r) {
    Real sum = column[r];
    for (Index k = 0; k < count; ++k) sum = std::fma(panel[k * lead + r], -factors[k * step], sum);
    column[r] = sum;
  }
}

template <class Real>
DRAPE_AVX512 void subtract_columns_avx512(Real* column, const Real* panel, Index lead,
                                          const Real* factors, Index step, Index count,
                                          Index rows) {
  constexpr Index lanes = kLanes<Real>;
  Index r = 0;
  for (; r + 4 * lanes <= rows; r += 4 * lanes) {
    typename Vectors<Real>::Avx512 sum[4];
    for (Index l = 0; l < 4; ++l) sum[l] = load5(column + r + l * lanes);
    for (Index k = 0; k < count; ++k) {
      const auto b = all5(-factors[k * step]);
      const Real* from = panel + k * lead + r;
      for (Index l = 0; l < 4; ++l) sum[l] = fma5(load5(from + l * lanes), b, sum[l]);
    }
    for (Index l = 0; l < 4; ++l) store5(column + r + l * lanes, sum[l]);
  }
  for (; r < rows; r += lanes) {
    auto sum = load5(column + r, rows - r);
    for (Index k = 0; k < count; ++k) {
      sum = fma5(load5(panel + k * lead + r, rows - r), all5(-factors[k * step]), sum);
    }
    store5(column + r, sum, rows - r);
  }
}

template <class Real>
DRAPE_AVX2 void dot_columns_avx2(const Real* panel, Index lead, const Real* vector, Index rows,
                                 Index count, Real* dots) {
  constexpr Index half = kLanes<Real> / 2;
  for (Index k = 0; k < count; k += 4) {
    typename Vectors<Real>::Avx2 sum[4][2] = {};
    const Real* from = panel + k * lead;
    const Index most = std::min<Index>(4, count - k);
    Index r = 0;
    for (; r + 2 * half <= rows; r += 2 * half) {
      const auto low = load2(vector + r);
      const auto high = load2(vector + r + half);
#pragma GCC unroll 4
      for (Index c = 0; c < 4; ++c) {
        if (c >= most) break;
        sum[c][0] = fma2(load2(from + c * lead + r), low, sum[c][0]);
        sum[c][1] = fma2(load2(from + c * lead + r + half), high, sum[c][1]);
      }
    }
    for (Index c = 0; c < most; ++c) {
      Real lanes[2 * half];
      store2(lanes, sum[c][0]);
      store2(lanes + half, sum[c][1]);
      for (Index q = r; q < rows; ++q) {
        lanes[q - r] = std::fma(from[c * lead + q], vector[q], lanes[q - r]);
      }
      dots[k + c] = sum_of(lanes);
    }
  }
}

template <class Real>
DRAPE_AVX512 void dot_columns_avx512(const Real* panel, Index lead, const Real* vector, Index rows,
                                     Index count, Real* dots) {
  constexpr Index lanes = kLanes<Real>;
  typename Vectors<Real>::Avx512 sum[kDots] = {};
  Index r = 0;
  for (; count == kDots && r + lanes <= rows; r += lanes) {
    const auto v = load5(vector + r);
#pragma GCC unroll 8
    for (Index c = 0; c < kDots; ++c) sum[c] = fma5(load5(panel + c * lead + r), v, sum[c]);
  }
  for (; r < rows; r += lanes) {
    const auto v = load5(vector + r, rows - r);
#pragma GCC unroll 8
    for (Index c = 0; c < kDots; ++c) {
      if (c >= count) break;
      sum[c] = fma5(load5(panel + c * lead + r, rows - r), v, sum[c]);
    }
  }
#pragma GCC unroll 8
  for (Index c = 0; c < kDots; ++c) {
    if (c >= count) break;
    dots[c] = sum5(sum[c]);
  }
}

template <class Real>
constexpr DenseKernels<Real> kAvx512{subtract_product_avx512<Real>, add_avx512<Real>,
                                     subtract_columns_avx512<Real>, dot_columns_avx512<Real>};
template <class Real>
constexpr DenseKernels<Real> kAvx2{subtract_product_avx2<Real>, add_avx2<Real>,
                                   subtract_columns_avx2<Real>, dot_columns_avx2<Real>};
#endif
template <class Real>
constexpr DenseKernels<Real> kPlain{subtract_product<Real>, add<Real>, subtract_columns<Real>,
                                    dot_columns<Real>};

}  // namespace

Instructions best_instructions() {
#if DRAPE_FUSED_X86
  if (__builtin_cpu_supports("avx512f")) return Instructions::avx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return Instructions::avx2;
#endif
  return Instructions::plain;
}

template <class Real>
const DenseKernels<Real>& dense_kernels(Instructions most) {
  static const Instructions best = best_instructions();
#if DRAPE_FUSED_X86
  switch (std::min(most, best)) {
    case Instructions::avx512:
      return kAvx512<Real>;
    case Instructions::avx2:
      return kAvx2<Real>;
    case Instructions::plain:
      break;
  }
#else
  static_cast<void>(most);
#endif
  return kPlain<Real>;
}

template const DenseKernels<double>& dense_kernels(Instructions);
template const DenseKernels<float>& dense_kernels(Instructions);

}  // namespace drape::simulate
