// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace drape::sim {

/// Scratch of the dense kernels, kept between calls.
struct DenseScratch {
  std::vector<double> strips;
  bool portable = false;  ///< without the processor's fused multiply-add; the same bytes, slowly
};

/// Cholesky factor of a symmetric matrix's first `cols` columns, in place, column-major with
/// leading dimension `rows` >= cols: the triangle on top becomes the factor, the rows below are
/// solved with it. False when a pivot is not positive. The same bytes on every processor: products
/// are added one by one in a fixed order, in vectors across rows.
[[nodiscard]] bool factor_columns(double* matrix, std::ptrdiff_t rows, std::ptrdiff_t cols,
                                  DenseScratch& scratch);

/// Writes minus A A^T into the lower triangle of `result`, a square of `rows` with leading
/// dimension `rows`: A is `rows` x `depth` at `a` with leading dimension `a_lead`. Values above the
/// diagonal within 12 rows of it are written too, others are not.
void set_minus_outer(const double* a, std::ptrdiff_t a_lead, std::ptrdiff_t rows,
                     std::ptrdiff_t depth, double* result, DenseScratch& scratch);

/// Takes A A^T from the lower triangle of `result`: A is `rows` x `depth` at `a` with leading
/// dimension `a_lead`; result has `result_lead`. Only its first `cols` columns are updated. Values
/// above the diagonal within 12 rows of it are changed too.
void subtract_outer(const double* a, std::ptrdiff_t a_lead, std::ptrdiff_t rows,
                    std::ptrdiff_t cols, std::ptrdiff_t depth, double* result,
                    std::ptrdiff_t result_lead, DenseScratch& scratch);

}  // namespace drape::sim
