// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/dense.hpp"

#include <algorithm>
#include <cmath>

namespace drape::simulate {
namespace {

using Index = std::ptrdiff_t;

template <class Real>
constexpr Index kRows = DenseKernels<Real>::tile_rows;  // also the columns of a block
template <class Real>
constexpr Index kLanes = DenseKernels<Real>::lanes;
constexpr Index kCols = DenseKernels<double>::tile_cols;
constexpr Index kDots = DenseKernels<double>::dots;
constexpr Index kFew = 24;     // columns factored one by one
constexpr Index kDepth = 192;  // columns of a product at once: two strips of them stay in the cache

/// Columns `first` to `last` of a trapezoid, from row `top` on: a factor A of a product A A^T.
template <class Real>
struct Part {
  const Real* values;
  Index rows, top, first, last;

  [[nodiscard]] Index height() const { return rows - top; }
  [[nodiscard]] Index depth() const { return last - first; }
  [[nodiscard]] const Real* column(Index k) const {
    return values + trapezoid_column<Real>(rows, first + k) + top;
  }
};

/// Strips of kRows rows, each stored column by column; zeros fill the last strip.
template <class Real>
void pack(const Part<Real>& a, std::vector<Real>& packed) {
  constexpr Index high = kRows<Real>;
  const Index depth = a.depth();
  const Index strips = (a.height() + high - 1) / high;
  packed.resize(std::max<std::size_t>(packed.size(), strips * high * depth));
  for (Index s = 0; s < strips; ++s) {
    Real* to = packed.data() + s * high * depth;
    const Index count = std::min(high, a.height() - s * high);
    for (Index k = 0; k < depth; ++k) {
      const Real* from = a.column(k) + s * high;
      std::copy(from, from + count, to + k * high);
      std::fill(to + k * high + count, to + (k + 1) * high, Real{0});
    }
  }
}

/// Takes A A^T off a lower triangle, or sets that to minus it: `cols` columns; `place` says where
/// row 0 of column j would lie.
template <class Real, class Place>
void subtract_square(const Part<Real>& a, Index cols, bool set, DenseScratch<Real>& scratch,
                     const Place& place) {
  constexpr Index high = kRows<Real>;
  pack(a, scratch.strips);
  const DenseKernels<Real>& run = dense_kernels<Real>(scratch.most);
  const Index depth = a.depth();
  for (Index j = 0; j < cols; j += kCols) {
    const Index width = std::min(kCols, cols - j);
    const Real* narrow = scratch.strips.data() + (j - j % high) * depth + j % high;
    Real* column = place(j);
    const Index lead = width > 1 ? place(j + 1) - column : 0;
    // Whole vectors above the diagonal are left out, but for what a 3x3 block on it has there.
    Index skip = std::max<Index>(0, j % high - 2) / kLanes<Real> * kLanes<Real>;
    for (Index i = j - j % high; i < a.height(); i += high, skip = 0) {
      run.subtract_product(
          scratch.strips.data() + i * depth + skip, narrow, depth,
          {column + i + skip, lead, std::min(high, a.height() - i) - skip, width, set});
    }
  }
}

/// Takes from columns `middle` to `last` what columns `first` to `middle` of the factor make there.
template <class Real>
void subtract_outer(Real* trapezoid, Index rows, Index first, Index middle, Index last,
                    DenseScratch<Real>& scratch) {
  const Part<Real> a{trapezoid, rows, middle, first, middle};
  subtract_square(a, last - middle, false, scratch, [&](Index j) {
    return trapezoid + trapezoid_column<Real>(rows, middle + j) + middle;
  });
}

/// Columns of one block, one by one.
template <class Real>
bool factor_few(Real* trapezoid, Index rows, Index first, Index last,
                const DenseKernels<Real>& run) {
  Real* block = trapezoid + trapezoid_column<Real>(rows, first);
  const Index lead = rows - first + first % kRows<Real>;
  for (Index c = first; c < last; ++c) {
    Real* column = block + (c - first) * lead + c;
    run.subtract(column, block + c, lead, block + c, lead, c - first, rows - c);
    if (!(column[0] > 0)) return false;
    const Real pivot = std::sqrt(column[0]);
    const Real inverse = 1 / pivot;
    column[0] = inverse;
    for (Index r = 1; r < rows - c; ++r) column[r] *= inverse;
  }
  return true;
}

/// The left half, what it makes of the right half, the right half.
template <class Real>
bool factor_range(Real* trapezoid, Index rows, Index first, Index last,
                  DenseScratch<Real>& scratch) {
  const Index count = last - first;
  if (count <= kFew) {
    return factor_few(trapezoid, rows, first, last, dense_kernels<Real>(scratch.most));
  }
  const Index unit = count > kRows<Real> ? kRows<Real> : kFew;
  const Index middle = first + (count + unit - 1) / unit / 2 * unit;
  if (!factor_range(trapezoid, rows, first, middle, scratch)) return false;
  subtract_outer(trapezoid, rows, first, middle, last, scratch);
  return factor_range(trapezoid, rows, middle, last, scratch);
}

}  // namespace

template <class Real>
bool factor_columns(Real* trapezoid, Index rows, Index cols, DenseScratch<Real>& scratch) {
  return factor_range(trapezoid, rows, 0, cols, scratch);
}

template <class Real>
void set_minus_outer(const Real* trapezoid, Index rows, Index cols, Real* triangle,
                     DenseScratch<Real>& scratch) {
  const Index size = rows - cols;
  for (Index first = 0; first < cols; first += kDepth) {
    const Part<Real> a{trapezoid, rows, cols, first, std::min(cols, first + kDepth)};
    subtract_square(a, size, first == 0, scratch,
                    [&](Index j) { return triangle + trapezoid_column<Real>(size, j); });
  }
}

template <class Real>
void solve_columns(const Real* trapezoid, Index rows, Index cols, Real* x, Instructions most) {
  const DenseKernels<Real>& run = dense_kernels<Real>(most);
  for (Index first = 0; first < cols; first += kDots) {
    const Real* columns = trapezoid + trapezoid_column<Real>(rows, first);
    const Index lead = rows - first + first % kRows<Real>;
    const Index last = std::min(cols, first + kDots);
    for (Index c = first; c < last; ++c) {
      const Real* column = columns + (c - first) * lead;
      x[c] *= column[c];
      for (Index r = c + 1; r < last; ++r) x[r] -= column[r] * x[c];
    }
    run.subtract(x + last, columns + last, lead, x + first, 1, last - first, rows - last);
  }
}

template <class Real>
void solve_columns_transposed(const Real* trapezoid, Index rows, Index cols, Real* x,
                              Instructions most) {
  const DenseKernels<Real>& run = dense_kernels<Real>(most);
  Real dots[kDots];
  for (Index last = cols; last > 0;) {
    const Index first = (last - 1) / kDots * kDots;
    const Real* columns = trapezoid + trapezoid_column<Real>(rows, first);
    const Index lead = rows - first + first % kRows<Real>;
    run.dot(columns + last, lead, x + last, rows - last, last - first, dots);
    for (Index c = last; c-- > first;) {
      x[c] = (x[c] - dots[c - first]) * columns[(c - first) * lead + c];
      for (Index k = first; k < c; ++k) dots[k - first] += columns[(k - first) * lead + c] * x[c];
    }
    last = first;
  }
}

template bool factor_columns(double*, Index, Index, DenseScratch<double>&);
template bool factor_columns(float*, Index, Index, DenseScratch<float>&);
template void set_minus_outer(const double*, Index, Index, double*, DenseScratch<double>&);
template void set_minus_outer(const float*, Index, Index, float*, DenseScratch<float>&);
template void solve_columns(const double*, Index, Index, double*, Instructions);
template void solve_columns(const float*, Index, Index, float*, Instructions);
template void solve_columns_transposed(const double*, Index, Index, double*, Instructions);
template void solve_columns_transposed(const float*, Index, Index, float*, Instructions);

}  // namespace drape::simulate
