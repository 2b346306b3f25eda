// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/neighbours.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

// Share of the spacing: a cell sheared by up to 60 degrees has its corners farther from its
// diagonal.
constexpr double kSharpest = 0.25;

int rows_apart(const GridSpec& grid, int i, int j) {
  return std::abs(i / grid.cols - j / grid.cols);
}

int cols_apart(const GridSpec& grid, int i, int j) {
  return std::abs(i % grid.cols - j % grid.cols);
}

}  // namespace

bool are_two_layers(const GridSpec& grid, const std::array<int, 4>& particle, int firsts) {
  for (int k = 0; k < firsts; ++k) {
    for (int l = firsts; l < 4; ++l) {
      if (particle[k] == particle[l]) return false;
    }
  }
  int top = grid.rows, bottom = 0, left = grid.cols, right = 0;
  for (const int i : particle) {
    const int row = i / grid.cols, col = i % grid.cols;
    top = std::min(top, row);
    bottom = std::max(bottom, row);
    left = std::min(left, col);
    right = std::max(right, col);
  }
  return bottom - top > 1 || right - left > 1;
}

double layers_apart_m(const GridSpec& grid, const std::array<int, 4>& particle, int firsts,
                      double thickness_m) {
  const double least = kSharpest * std::min(grid.warp_spacing_m(), grid.weft_spacing_m());
  if (thickness_m <= least) return thickness_m;
  for (int k = 0; k < firsts; ++k) {
    for (int l = firsts; l < 4; ++l) {
      const int i = particle[k], j = particle[l];
      if (rows_apart(grid, i, j) < 2 && cols_apart(grid, i, j) < 2) return least;
    }
  }
  return thickness_m;
}

bool are_neighbours(const GridSpec& grid, int one, int two) {
  return rows_apart(grid, one, two) < 2 && cols_apart(grid, one, two) < 2;
}

/// In an affine image of the grid two layers are half a diagonal of a cell apart in steps, and the
/// image shortens no distance by more than its smaller singular value. The sheet deviates from it.
double least_apart_m(const GridSpec& grid, const Field& position, int one, int two) {
  Vector3d middle = Vector3d::Zero(), down = Vector3d::Zero(), right = Vector3d::Zero();
  for (const int i : {one, two}) {
    const Vector3d a = at(position, i), b = at(position, i + 1);
    const Vector3d c = at(position, i + grid.cols), d = at(position, i + grid.cols + 1);
    middle += 0.125 * (a + b + c + d);
    down += 0.25 * (c + d - a - b);
    right += 0.25 * (b + d - a - c);
  }
  const int rows = one / grid.cols + two / grid.cols + 1;
  const int cols = one % grid.cols + two % grid.cols + 1;
  const double row = 0.5 * rows, col = 0.5 * cols;  // row and column of the middle
  double off2 = 0;
  for (const int i : {one, two}) {
    const int first_row = i / grid.cols, first_col = i % grid.cols;
    for (int k = 0; k < 4; ++k) {
      const int at_row = first_row + k / 2, at_col = first_col + k % 2;
      const Vector3d image = middle + (at_row - row) * down + (at_col - col) * right;
      off2 = std::max(off2, (at(position, grid.index(at_row, at_col)) - image).squaredNorm());
    }
  }
  const double dd = down.squaredNorm(), rr = right.squaredNorm(), dr = down.dot(right);
  const double least2 = 0.5 * (dd + rr - std::sqrt((dd - rr) * (dd - rr) + 4 * dr * dr));
  return std::sqrt(std::max(0.0, least2) / 2) - 2 * std::sqrt(off2);
}

}  // namespace drape::simulate
