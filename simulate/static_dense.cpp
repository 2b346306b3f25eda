// SPDX-License-Identifier: Apache-2.0
#include "simulate/static_dense.hpp"

#include <algorithm>
#include <cmath>

namespace drape::sim {
namespace {

using Index = std::ptrdiff_t;

constexpr Index kRows = DenseKernels::tile_rows;  // also the columns of a block
constexpr Index kCols = DenseKernels::tile_cols;
constexpr Index kDots = DenseKernels::dots;
constexpr Index kDepth = 192;  // columns of a product at once: two strips of them stay in the cache

/// Columns `first` to `last` of a trapezoid, from row `top` on: a factor A of a product A A^T.
struct Part {
  const double* values;
  Index rows, top, first, last;

  [[nodiscard]] Index height() const { return rows - top; }
  [[nodiscard]] Index depth() const { return last - first; }
  [[nodiscard]] const double* column(Index k) const {
    return values + trapezoid_column(rows, first + k) + top;
  }
};

/// Strips of kRows rows, each stored column by column; zeros fill the last strip.
void pack(const Part& a, std::vector<double>& packed) {
  const Index depth = a.depth();
  const Index strips = (a.height() + kRows - 1) / kRows;
  packed.resize(std::max<std::size_t>(packed.size(), strips * kRows * depth));
  for (Index s = 0; s < strips; ++s) {
    double* to = packed.data() + s * kRows * depth;
    const Index count = std::min(kRows, a.height() - s * kRows);
    for (Index k = 0; k < depth; ++k) {
      const double* from = a.column(k) + s * kRows;
      std::copy(from, from + count, to + k * kRows);
      std::fill(to + k * kRows + count, to + (k + 1) * kRows, 0.0);
    }
  }
}

/// Calls `use` with every tile of A A^T that meets the lower triangle of its first `cols` columns.
template <class Use>
void for_each_tile(const Part& a, Index cols, DenseScratch& scratch, const Use& use) {
  pack(a, scratch.strips);
  const DenseKernels& run = dense_kernels(scratch.most);
  const Index depth = a.depth();
  double tile[kRows * kCols];
  for (Index j = 0; j < cols; j += kCols) {
    const Index width = std::min(kCols, cols - j);
    const double* narrow = scratch.strips.data() + (j - j % kRows) * depth + j % kRows;
    for (Index i = j - j % kRows; i < a.height(); i += kRows) {
      run.multiply(scratch.strips.data() + i * depth, narrow, depth, tile);
      use(i, j, std::min(kRows, a.height() - i), width, tile);
    }
  }
}

/// Takes from columns `middle` to `last` what columns `first` to `middle` of the factor make there.
void subtract_outer(double* trapezoid, Index rows, Index first, Index middle, Index last,
                    DenseScratch& scratch) {
  const Part a{trapezoid, rows, middle, first, middle};
  for_each_tile(a, last - middle, scratch,
                [&](Index i, Index j, Index height, Index width, const double* tile) {
                  for (Index c = 0; c < width; ++c) {
                    double* to = trapezoid + trapezoid_column(rows, middle + j + c) + middle + i;
                    for (Index r = 0; r < height; ++r) to[r] -= tile[c * kRows + r];
                  }
                });
}

/// The columns of one block from `first` on, one by one.
bool factor_block(double* trapezoid, Index rows, Index first, Index last, const DenseKernels& run) {
  double* block = trapezoid + trapezoid_column(rows, first);
  const Index lead = rows - first;
  for (Index c = first; c < last; ++c) {
    double* column = block + (c - first) * lead + c;
    run.subtract(column, block + c, lead, block + c, lead, c - first, rows - c);
    if (!(column[0] > 0)) return false;
    const double pivot = std::sqrt(column[0]);
    const double inverse = 1 / pivot;
    column[0] = pivot;
    for (Index r = 1; r < rows - c; ++r) column[r] *= inverse;
  }
  return true;
}

/// The left half, what it makes of the right half, the right half.
bool factor_range(double* trapezoid, Index rows, Index first, Index last, DenseScratch& scratch) {
  if (last - first <= kRows) {
    return factor_block(trapezoid, rows, first, last, dense_kernels(scratch.most));
  }
  const Index blocks = (last - first + kRows - 1) / kRows;
  const Index middle = first + blocks / 2 * kRows;
  if (!factor_range(trapezoid, rows, first, middle, scratch)) return false;
  subtract_outer(trapezoid, rows, first, middle, last, scratch);
  return factor_range(trapezoid, rows, middle, last, scratch);
}

}  // namespace

bool factor_columns(double* trapezoid, Index rows, Index cols, DenseScratch& scratch) {
  return factor_range(trapezoid, rows, 0, cols, scratch);
}

void set_minus_outer(const double* trapezoid, Index rows, Index cols, double* triangle,
                     DenseScratch& scratch) {
  const Index size = rows - cols;
  for (Index first = 0; first < cols; first += kDepth) {
    const Part a{trapezoid, rows, cols, first, std::min(cols, first + kDepth)};
    for_each_tile(a, size, scratch,
                  [&](Index i, Index j, Index height, Index width, const double* tile) {
                    for (Index c = 0; c < width; ++c) {
                      double* to = triangle + trapezoid_column(size, j + c) + i;
                      const double* from = tile + c * kRows;
                      if (first == 0) {
                        for (Index r = 0; r < height; ++r) to[r] = -from[r];
                      } else {
                        for (Index r = 0; r < height; ++r) to[r] -= from[r];
                      }
                    }
                  });
  }
}

void solve_columns(const double* trapezoid, Index rows, Index cols, double* x, Instructions most) {
  const DenseKernels& run = dense_kernels(most);
  for (Index first = 0; first < cols; first += kRows) {
    const double* block = trapezoid + trapezoid_column(rows, first);
    const Index lead = rows - first;
    const Index last = std::min(cols, first + kRows);
    for (Index c = first; c < last; ++c) {
      const double* column = block + (c - first) * lead;
      x[c] /= column[c];
      for (Index r = c + 1; r < last; ++r) x[r] -= column[r] * x[c];
    }
    run.subtract(x + last, block + last, lead, x + first, 1, last - first, rows - last);
  }
}

void solve_columns_transposed(const double* trapezoid, Index rows, Index cols, double* x,
                              Instructions most) {
  const DenseKernels& run = dense_kernels(most);
  double dots[kDots];
  for (Index last = cols; last > 0;) {
    const Index first = (last - 1) / kDots * kDots;
    const double* columns = trapezoid + trapezoid_column(rows, first);
    const Index lead = rows - first + first % kRows;
    if (last - first == kDots) {
      run.dot(columns + last, lead, x + last, rows - last, dots);
    } else {
      for (Index c = first; c < last; ++c) {
        dots[c - first] = 0;
        for (Index r = last; r < rows; ++r)
          dots[c - first] += columns[(c - first) * lead + r] * x[r];
      }
    }
    for (Index c = last; c-- > first;) {
      const double* column = columns + (c - first) * lead;
      double sum = x[c] - dots[c - first];
      for (Index r = c + 1; r < last; ++r) sum -= column[r] * x[r];
      x[c] = sum / column[c];
    }
    last = first;
  }
}

}  // namespace drape::sim
