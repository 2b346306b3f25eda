// SPDX-License-Identifier: Apache-2.0
#include "simulate/static_dense.hpp"

#include <algorithm>
#include <cmath>

#include "simulate/wide.hpp"

namespace drape::sim {
namespace {

using Index = std::ptrdiff_t;

constexpr Index kRows = 8;    // of a tile that stays in registers
constexpr Index kCols = 4;    // the same
constexpr Index kPanel = 24;  // columns factored one by one before the rest is updated

typedef double Lane __attribute__((vector_size(32), aligned(8)));
constexpr Index kLane = 4;

/// Strips of `height` rows, each stored column by column; zeros fill the last strip.
void pack(const double* a, Index lead, Index rows, Index depth, Index height,
          std::vector<double>& packed) {
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

/// tile (8 x 4, column-major) = sum over k of wide(:, k) narrow(:, k)^T.
DRAPE_WIDE
void multiply_strips(const double* wide, const double* narrow, Index depth, double* tile) {
  Lane sum[kCols][2] = {};
  for (Index k = 0; k < depth; ++k) {
    const Lane a0 = *reinterpret_cast<const Lane*>(wide + k * kRows);
    const Lane a1 = *reinterpret_cast<const Lane*>(wide + k * kRows + kLane);
    for (Index c = 0; c < kCols; ++c) {
      const double b = narrow[k * kCols + c];
      sum[c][0] += a0 * b;
      sum[c][1] += a1 * b;
    }
  }
  for (Index c = 0; c < kCols; ++c) {
    *reinterpret_cast<Lane*>(tile + c * kRows) = sum[c][0];
    *reinterpret_cast<Lane*>(tile + c * kRows + kLane) = sum[c][1];
  }
}

/// column -= columns before it in the panel, each times its entry in `row`.
DRAPE_WIDE
void subtract_columns(double* column, const double* panel, Index lead, const double* row,
                      Index count, Index rows) {
  Index r = 0;
  for (; r + kRows <= rows; r += kRows) {
    Lane s0 = *reinterpret_cast<const Lane*>(column + r);
    Lane s1 = *reinterpret_cast<const Lane*>(column + r + kLane);
    for (Index k = 0; k < count; ++k) {
      const double b = row[k * lead];
      s0 -= *reinterpret_cast<const Lane*>(panel + k * lead + r) * b;
      s1 -= *reinterpret_cast<const Lane*>(panel + k * lead + r + kLane) * b;
    }
    *reinterpret_cast<Lane*>(column + r) = s0;
    *reinterpret_cast<Lane*>(column + r + kLane) = s1;
  }
  for (; r < rows; ++r) {
    double sum = column[r];
    for (Index k = 0; k < count; ++k) sum -= panel[k * lead + r] * row[k * lead];
    column[r] = sum;
  }
}

}  // namespace

void subtract_outer(const double* a, Index a_lead, Index rows, Index cols, Index depth,
                    double* result, Index result_lead, DenseScratch& scratch) {
  pack(a, a_lead, rows, depth, kRows, scratch.wide);
  pack(a, a_lead, cols, depth, kCols, scratch.narrow);
  double tile[kRows * kCols];
  for (Index j = 0; j < cols; j += kCols) {
    const Index width = std::min(kCols, cols - j);
    for (Index i = j - j % kRows; i < rows; i += kRows) {
      multiply_strips(scratch.wide.data() + i * depth, scratch.narrow.data() + j * depth, depth,
                      tile);
      const Index height = std::min(kRows, rows - i);
      for (Index c = 0; c < width; ++c) {
        double* to = result + i + (j + c) * result_lead;
        for (Index r = 0; r < height; ++r) to[r] -= tile[c * kRows + r];
      }
    }
  }
}

bool factor_columns(double* matrix, Index rows, Index cols, DenseScratch& scratch) {
  for (Index first = 0; first < cols; first += kPanel) {
    const Index last = std::min(cols, first + kPanel);
    for (Index c = first; c < last; ++c) {
      double* column = matrix + c * rows + c;
      subtract_columns(column, matrix + first * rows + c, rows, matrix + first * rows + c,
                       c - first, rows - c);
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
