// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/kernels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>

#if defined(__GNUC__) && defined(__x86_64__) && defined(__OPTIMIZE__)
#define DRAPE_X86 1
#else
#define DRAPE_X86 0
#endif
// True if the compiler supports shuffles with variable indices.
#if defined(__GNUC__) && !defined(__clang__)
#define DRAPE_TURNS 1
#else
#define DRAPE_TURNS 0
#endif
// Inlined into the functions of each instruction set, so that it is compiled for that set.
#define DRAPE_INLINE inline __attribute__((always_inline))

namespace drape::simulate {
namespace {

using Index = std::ptrdiff_t;

constexpr Index kCols = DenseKernels::tile_cols;
constexpr Index kDots = DenseKernels::dots;
using Tile = DenseKernels::Tile;

/// `size` values in one register; `fused` if the instruction set has a fused multiply-add, which
/// the compiler then uses for a product and sum (this file permits it).
template <class Real, Index size, bool fused>
struct Pack {
  typedef Real Values __attribute__((vector_size(size * sizeof(Real))));
  Values v = {};

  DRAPE_INLINE void load(const Real* from) { std::memcpy(&v, from, sizeof v); }
  DRAPE_INLINE void store(Real* to) const { std::memcpy(to, &v, sizeof v); }
  /// Adds a * b, rounded once; b is a number or a vector.
  template <class Factor>
  DRAPE_INLINE void add_product(const Pack& a, const Factor& b) {
    if constexpr (fused) {
      v += a.v * b;
    } else {
      const Values each = b - Values{};
      for (Index k = 0; k < size; ++k) v[k] = std::fma(a.v[k], each[k], v[k]);
    }
  }
};

/// The inner loops for an instruction set with registers of `bytes` bytes.
template <class Real, Index bytes, bool fused>
struct Loops {
  static constexpr Index size = bytes / Index{sizeof(Real)};
  static constexpr Index rows = DenseKernels::tile_rows;
  static constexpr Index lanes = DenseKernels::lanes;
  /// Columns of a tile whose sums fit into registers together with their factors.
  static constexpr Index columns = bytes == 64 ? kCols : 4;
  using Register = Pack<Real, size, fused>;

  /// Computes `count` registers of rows by `columns` columns of the product.
  template <Index count>
  DRAPE_INLINE static void multiply(const Real* wide, const Real* narrow, Index depth,
                                    Real* product) {
    Register sum[columns][count];
    for (Index k = 0; k < depth; ++k) {
      Register a[count];
#pragma GCC unroll 8
      for (Index l = 0; l < count; ++l) a[l].load(wide + k * rows + l * size);
#pragma GCC unroll 8
      for (Index c = 0; c < columns; ++c) {
        const Real b = narrow[k * rows + c];
#pragma GCC unroll 8
        for (Index l = 0; l < count; ++l) sum[c][l].add_product(a[l], b);
      }
    }
#pragma GCC unroll 8
    for (Index c = 0; c < columns; ++c) {
#pragma GCC unroll 8
      for (Index l = 0; l < count; ++l) sum[c][l].store(product + c * rows + l * size);
    }
  }

  DRAPE_INLINE static void subtract_product(const Real* wide, const Real* narrow, Index depth,
                                            const Tile& tile) {
    Real product[rows * kCols];
    for (Index c = 0; c < kCols; c += columns) {
      for (Index r = 0; r < tile.height; r += 3 * size) {
        const Index left = tile.height - r;
        Real* to = product + c * rows + r;
        if (left > 2 * size) {
          multiply<3>(wide + r, narrow + c, depth, to);
        } else if (left > size) {
          multiply<2>(wide + r, narrow + c, depth, to);
        } else {
          multiply<1>(wide + r, narrow + c, depth, to);
        }
      }
    }
    for (Index c = 0; c < tile.width; ++c) {
      Real* to = tile.to + c * tile.lead;
      const Real* from = product + c * rows;
      for (Index r = 0; r < tile.height; ++r) to[r] = (tile.set ? Real{0} : to[r]) - from[r];
    }
  }

  /// Processes `registers` of rows in subtract_columns(); `tail` adds one that ends with row
  /// `height` and overlaps them. Rows in both are computed twice with equal results.
  template <Index registers, bool tail>
  DRAPE_INLINE static void subtract_rows(Real* column, const Real* panel, Index lead,
                                         const Real* factors, Index step, Index count,
                                         Index height) {
    constexpr Index all = registers + (tail ? 1 : 0);
    Index at[all];
    Register sum[all];
#pragma GCC unroll 8
    for (Index l = 0; l < all; ++l) {
      at[l] = l < registers ? l * size : height - size;
      sum[l].load(column + at[l]);
    }
    for (Index k = 0; k < count; ++k) {
#pragma GCC unroll 8
      for (Index l = 0; l < all; ++l) {
        Register a;
        a.load(panel + k * lead + at[l]);
        sum[l].add_product(a, -factors[k * step]);
      }
    }
#pragma GCC unroll 8
    for (Index l = 0; l < all; ++l) sum[l].store(column + at[l]);
  }

  template <bool tail>
  DRAPE_INLINE static void subtract_last(Real* column, const Real* panel, Index lead,
                                         const Real* factors, Index step, Index count,
                                         Index height) {
    switch (height / size) {
      case 1:
        return subtract_rows<1, tail>(column, panel, lead, factors, step, count, height);
      case 2:
        return subtract_rows<2, tail>(column, panel, lead, factors, step, count, height);
      case 3:
        return subtract_rows<3, tail>(column, panel, lead, factors, step, count, height);
      default:
        return subtract_rows<4, tail>(column, panel, lead, factors, step, count, height);
    }
  }

  DRAPE_INLINE static void subtract_columns(Real* column, const Real* panel, Index lead,
                                            const Real* factors, Index step, Index count,
                                            Index height) {
    if (height < size) {
      for (Index k = 0; k < count; ++k) {
        const Real factor = -factors[k * step];
        for (Index r = 0; r < height; ++r)
          column[r] = std::fma(panel[k * lead + r], factor, column[r]);
      }
      return;
    }
    while (height >= 5 * size) {
      subtract_rows<4, false>(column, panel, lead, factors, step, count, height);
      column += 4 * size;
      panel += 4 * size;
      height -= 4 * size;
    }
    if (height % size == 0)
      subtract_last<false>(column, panel, lead, factors, step, count, height);
    else
      subtract_last<true>(column, panel, lead, factors, step, count, height);
  }

#if DRAPE_TURNS
  using Lane = std::conditional_t<sizeof(Real) == 4, std::int32_t, std::int64_t>;
  typedef Lane Lanes __attribute__((vector_size(size * sizeof(Lane))));

  /// Adds the products of the last `left` rows to the first partial sums. Reads whole registers
  /// that end with the last row, and rotates them.
  template <Index count>
  DRAPE_INLINE static void add_tail(const Real* panel, Index lead, const Real* vector, Index height,
                                    Index left, Register (&sum)[count][1]) {
    Lanes lane;
    for (Index k = 0; k < size; ++k) lane[k] = static_cast<Lane>(k);
    const Lanes from = (lane + static_cast<Lane>(size - left)) & static_cast<Lane>(size - 1);
    const Lanes here = lane < static_cast<Lane>(left);
    Register v;
    v.load(vector + height - size);
    v.v = __builtin_shuffle(v.v, from);
#pragma GCC unroll 8
    for (Index c = 0; c < count; ++c) {
      Register a, more = sum[c][0];
      a.load(panel + c * lead + height - size);
      a.v = __builtin_shuffle(a.v, from);
      more.add_product(a, v.v);
      sum[c][0].v = here ? more.v : sum[c][0].v;
    }
  }
#endif

  /// Computes `count` dot products in `lanes` partial sums each, which are then added pairwise.
  template <Index count>
  DRAPE_INLINE static void dot(const Real* panel, Index lead, const Real* vector, Index height,
                               Real* dots) {
    constexpr Index registers = lanes / size;
    Register sum[count][registers];
    Index r = 0;
    for (; r + lanes <= height; r += lanes) {
#pragma GCC unroll 8
      for (Index l = 0; l < registers; ++l) {
        Register v;
        v.load(vector + r + l * size);
#pragma GCC unroll 8
        for (Index c = 0; c < count; ++c) {
          Register a;
          a.load(panel + c * lead + r + l * size);
          sum[c][l].add_product(a, v.v);
        }
      }
    }
#if DRAPE_TURNS
    if constexpr (size == lanes) {
      if (r < height && height >= lanes) {
        add_tail<count>(panel, lead, vector, height, height - r, sum);
        r = height;
      }
    }
#endif
#pragma GCC unroll 8
    for (Index c = 0; c < count; ++c) {
      Real partial[lanes];
#pragma GCC unroll 8
      for (Index l = 0; l < registers; ++l) sum[c][l].store(partial + l * size);
      for (Index q = r; q < height; ++q) {
        partial[q - r] = std::fma(panel[c * lead + q], vector[q], partial[q - r]);
      }
      for (Index half = lanes / 2; half > 0; half /= 2) {
        for (Index k = 0; k < half; ++k) partial[k] += partial[k + half];
      }
      dots[c] = partial[0];
    }
  }

  DRAPE_INLINE static void dot_columns(const Real* panel, Index lead, const Real* vector,
                                       Index height, Index count, Real* dots) {
    constexpr Index most = bytes == 64 ? kDots : 4;
    Index k = 0;
    for (; k + most <= count; k += most)
      dot<most>(panel + k * lead, lead, vector, height, dots + k);
    for (; k < count; ++k) dot<1>(panel + k * lead, lead, vector, height, dots + k);
  }
};

// One set of functions per instruction set; they differ only in the attribute.
// NOLINTBEGIN(bugprone-macro-parentheses): an attribute does not stand in parentheses.
#define DRAPE_KERNELS(Set, bytes, fused, attribute)                                              \
  template <class Real>                                                                          \
  struct Set {                                                                                   \
    using L = Loops<Real, bytes, fused>;                                                         \
    attribute static void subtract_product(const Real* wide, const Real* narrow, Index depth,    \
                                           const Tile& tile) {                                   \
      L::subtract_product(wide, narrow, depth, tile);                                            \
    }                                                                                            \
    attribute static void subtract(Real* column, const Real* panel, Index lead,                  \
                                   const Real* factors, Index step, Index count, Index height) { \
      L::subtract_columns(column, panel, lead, factors, step, count, height);                    \
    }                                                                                            \
    attribute static void dot(const Real* panel, Index lead, const Real* vector, Index height,   \
                              Index count, Real* dots) {                                         \
      L::dot_columns(panel, lead, vector, height, count, dots);                                  \
    }                                                                                            \
    static constexpr DenseKernels kernels{subtract_product, subtract, dot};                      \
  };
// NOLINTEND(bugprone-macro-parentheses)

DRAPE_KERNELS(Plain, 16, false, )
#if DRAPE_X86
DRAPE_KERNELS(Avx2, 32, true, __attribute__((target("avx2,fma"))))
DRAPE_KERNELS(Avx512, 64, true, __attribute__((target("avx512f"))))
#endif

}  // namespace

Instructions best_instructions() {
#if DRAPE_X86
  if (__builtin_cpu_supports("avx512f")) return Instructions::avx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return Instructions::avx2;
#endif
  return Instructions::plain;
}

const DenseKernels& dense_kernels([[maybe_unused]] Instructions most) {
#if DRAPE_X86
  static const Instructions best = best_instructions();
  switch (std::min(most, best)) {
    case Instructions::avx512:
      return Avx512<float>::kernels;
    case Instructions::avx2:
      return Avx2<float>::kernels;
    case Instructions::plain:
      break;
  }
#endif
  return Plain<float>::kernels;
}

}  // namespace drape::simulate
