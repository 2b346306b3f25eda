// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/row_distances.hpp"

#include <algorithm>

#include "detect/ellipses/lanes.hpp"

namespace drape::detect {
namespace {

/// Coefficients of an ellipse, and what is written.
struct Row {
  double cx, m11, m12, m22, uy, deepest;
  double *d, *vx, *vy;
};

DRAPE_WIDE_VECTORS void fill_row(const Row& row, int first_x, int count) {
  const Row r = row;
  double* const __restrict d = r.d;
  double* const __restrict to_vx = r.vx;
  double* const __restrict to_vy = r.vy;
  for (int k = 0; k < count; ++k) {
    const double ux = static_cast<double>(first_x + k) - r.cx;
    const double vx = r.m11 * ux + r.m12 * r.uy, vy = r.m12 * ux + r.m22 * r.uy;
    const double wx = r.m11 * vx + r.m12 * vy, wy = r.m12 * vx + r.m22 * vy;
    const double norm = std::max(std::sqrt(wx * wx + wy * wy), 1e-9);
    const double rho = std::sqrt(vx * vx + vy * vy);
    const double out = (rho - 1) * rho / norm;
    d[k] = rho < BlurredEllipse::shallowest ? r.deepest : out;
    to_vx[k] = vx;
    to_vy[k] = vy;
  }
}

}  // namespace

void RowDistances::fill(const BlurredEllipse& model, int first_x, int y) {
  const BlurredEllipse::Vector& p = model.parameters();
  fill_row({p(BlurredEllipse::cx), p(BlurredEllipse::m11), p(BlurredEllipse::m12),
            p(BlurredEllipse::m22), y - p(BlurredEllipse::cy), model.deepest(), d_.data(),
            vx_.data(), vy_.data()},
           first_x, static_cast<int>(d_.size()));
}

}  // namespace drape::detect
