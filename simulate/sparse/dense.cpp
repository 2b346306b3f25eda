// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/dense.hpp"

#include <algorithm>
#include <cmath>

namespace drape::simulate {
namespace {

using Index = std::ptrdiff_t;

constexpr Index kRows = DenseKernels::tile_rows;  // also the columns per block
constexpr Index kLanes = DenseKernels::lanes;
constexpr Index kCols = DenseKernels::tile_cols;
constexpr Index kDots = DenseKernels::dots;
constexpr Index kFew = 24;     // width below which columns are factorised one by one
constexpr Index kDepth = 192;  // columns per product, so that two strips fit into the cache

/// Columns `first` to `last` of a trapezoid, from row `top` on: the factor A of a product A A^T.
struct Part {
  const float* values;
  Index rows, top, first, last;

  [[nodiscard]] Index height() const { return rows - top; }
  [[nodiscard]] Index depth() const { return last - first; }
  [[nodiscard]] const float* column(Index k) const {
    return values + trapezoid_column(rows, first + k) + top;
  }
};

/// Packs rows into strips of kRows, each column by column; zeros pad the last strip.
void pack(const Part& a, std::vector<float>& packed) {
  constexpr Index high = kRows;
  const Index depth = a.depth();
  const Index strips = (a.height() + high - 1) / high;
  packed.resize(std::max<std::size_t>(packed.size(), strips * high * depth));
  for (Index s = 0; s < strips; ++s) {
    float* to = packed.data() + s * high * depth;
    const Index count = std::min(high, a.height() - s * high);
    for (Index k = 0; k < depth; ++k) {
      const float* from = a.column(k) + s * high;
      std::copy(from, from + count, to + k * high);
      std::fill(to + k * high + count, to + (k + 1) * high, 0.0F);
    }
  }
}

/// Subtracts A A^T from the first `cols` columns of a lower triangle, or sets it to -A A^T; `place`
/// gives the position of row 0 of column j.
template <class Place>
void subtract_square(const Part& a, Index cols, bool set, DenseScratch& scratch,
                     const Place& place) {
  constexpr Index high = kRows;
  pack(a, scratch.strips);
  const DenseKernels& run = dense_kernels(scratch.most);
  const Index depth = a.depth();
  for (Index j = 0; j < cols; j += kCols) {
    const Index width = std::min(kCols, cols - j);
    const float* narrow = scratch.strips.data() + (j - j % high) * depth + j % high;
    float* column = place(j);
    const Index lead = width > 1 ? place(j + 1) - column : 0;
    // Skips whole vectors above the diagonal, except those of a 3x3 block on it.
    Index skip = std::max<Index>(0, j % high - 2) / kLanes * kLanes;
    for (Index i = j - j % high; i < a.height(); i += high, skip = 0) {
      run.subtract_product(
          scratch.strips.data() + i * depth + skip, narrow, depth,
          {column + i + skip, lead, std::min(high, a.height() - i) - skip, width, set});
    }
  }
}

/// Subtracts the outer product of columns `first` to `middle` from columns `middle` to `last`.
void subtract_outer(float* trapezoid, Index rows, Index first, Index middle, Index last,
                    DenseScratch& scratch) {
  const Part a{trapezoid, rows, middle, first, middle};
  subtract_square(a, last - middle, false, scratch,
                  [&](Index j) { return trapezoid + trapezoid_column(rows, middle + j) + middle; });
}

/// Factorises the columns of one block one by one.
bool factor_few(float* trapezoid, Index rows, Index first, Index last, const DenseKernels& run) {
  float* block = trapezoid + trapezoid_column(rows, first);
  const Index lead = rows - first + first % kRows;
  for (Index c = first; c < last; ++c) {
    float* column = block + (c - first) * lead + c;
    run.subtract(column, block + c, lead, block + c, lead, c - first, rows - c);
    if (!(column[0] > 0)) return false;
    const float pivot = std::sqrt(column[0]);
    const float inverse = 1 / pivot;
    column[0] = inverse;
    for (Index r = 1; r < rows - c; ++r) column[r] *= inverse;
  }
  return true;
}

/// Factorises recursively: the left half, its update of the right half, the right half.
bool factor_range(float* trapezoid, Index rows, Index first, Index last, DenseScratch& scratch) {
  const Index count = last - first;
  if (count <= kFew) {
    return factor_few(trapezoid, rows, first, last, dense_kernels(scratch.most));
  }
  const Index unit = count > kRows ? kRows : kFew;
  const Index middle = first + (count + unit - 1) / unit / 2 * unit;
  if (!factor_range(trapezoid, rows, first, middle, scratch)) return false;
  subtract_outer(trapezoid, rows, first, middle, last, scratch);
  return factor_range(trapezoid, rows, middle, last, scratch);
}

}  // namespace

bool factor_columns(float* trapezoid, Index rows, Index cols, DenseScratch& scratch) {
  return factor_range(trapezoid, rows, 0, cols, scratch);
}

void set_minus_outer(const float* trapezoid, Index rows, Index cols, float* triangle,
                     DenseScratch& scratch) {
  const Index size = rows - cols;
  for (Index first = 0; first < cols; first += kDepth) {
    const Part a{trapezoid, rows, cols, first, std::min(cols, first + kDepth)};
    subtract_square(a, size, first == 0, scratch,
                    [&](Index j) { return triangle + trapezoid_column(size, j); });
  }
}

void solve_columns(const float* trapezoid, Index rows, Index cols, float* x, Instructions most) {
  const DenseKernels& run = dense_kernels(most);
  for (Index first = 0; first < cols; first += kDots) {
    const float* columns = trapezoid + trapezoid_column(rows, first);
    const Index lead = rows - first + first % kRows;
    const Index last = std::min(cols, first + kDots);
    for (Index c = first; c < last; ++c) {
      const float* column = columns + (c - first) * lead;
      x[c] *= column[c];
      for (Index r = c + 1; r < last; ++r) x[r] -= column[r] * x[c];
    }
    run.subtract(x + last, columns + last, lead, x + first, 1, last - first, rows - last);
  }
}

void solve_columns_transposed(const float* trapezoid, Index rows, Index cols, float* x,
                              Instructions most) {
  const DenseKernels& run = dense_kernels(most);
  float dots[kDots];
  for (Index last = cols; last > 0;) {
    const Index first = (last - 1) / kDots * kDots;
    const float* columns = trapezoid + trapezoid_column(rows, first);
    const Index lead = rows - first + first % kRows;
    run.dot(columns + last, lead, x + last, rows - last, last - first, dots);
    for (Index c = last; c-- > first;) {
      x[c] = (x[c] - dots[c - first]) * columns[(c - first) * lead + c];
      for (Index k = first; k < c; ++k) dots[k - first] += columns[(k - first) * lead + c] * x[c];
    }
    last = first;
  }
}

}  // namespace drape::simulate
