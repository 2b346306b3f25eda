// SPDX-License-Identifier: Apache-2.0
// Folds of a sheet's border.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "simulate/ensemble/branches.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFold = 3e-3;  // m; by which a fold of the hem stands out
constexpr int kHemSamples = 256;

/// Particles along the border, once round.
std::vector<int> border_of(const GridSpec& grid) {
  std::vector<int> border;
  for (int c = 0; c + 1 < grid.cols; ++c) border.push_back(grid.index(0, c));
  for (int r = 0; r + 1 < grid.rows; ++r) border.push_back(grid.index(r, grid.cols - 1));
  for (int c = grid.cols - 1; c > 0; --c) border.push_back(grid.index(grid.rows - 1, c));
  for (int r = grid.rows - 1; r > 0; --r) border.push_back(grid.index(r, 0));
  return border;
}

/// Maxima that stand out by kFold from the lowest value towards a higher one on both sides.
int count_folds(const std::vector<double>& radius) {
  const auto n = static_cast<int>(radius.size());
  const auto value = [&](int i) { return radius[((i % n) + n) % n]; };
  int folds = 0;
  for (int i = 0; i < n; ++i) {
    if (value(i) <= value(i - 1) || value(i) < value(i + 1)) continue;
    double drop[2] = {0, 0};
    for (int side = 0; side < 2; ++side) {
      for (int k = 1; k < n; ++k) {
        const double other = value(side == 0 ? i - k : i + k);
        if (other > value(i)) break;
        drop[side] = std::max(drop[side], value(i) - other);
      }
    }
    folds += std::min(drop[0], drop[1]) > kFold;
  }
  return folds;
}

}  // namespace

HemLabel label_hem(const GridSpec& grid, const Field& position) {
  const std::vector<int> border = border_of(grid);
  Vector2d middle = Vector2d::Zero();
  for (int i = 0; i < grid.count(); ++i) middle += at(position, i).head<2>();
  middle /= grid.count();
  const auto count = static_cast<double>(border.size());
  HemLabel label;
  std::vector<double> radius(kHemSamples);
  for (int k = 0; k < kHemSamples; ++k) {
    const double place = k * count / kHemSamples;
    const auto first = static_cast<std::size_t>(place);
    const double fraction = place - static_cast<double>(first);
    const Vector3d p = (1 - fraction) * at(position, border[first]) +
                       fraction * at(position, border[(first + 1) % border.size()]);
    radius[k] = (p.head<2>() - middle).norm();
  }
  for (std::size_t m = 0; m < label.amplitude_m.size(); ++m) {
    std::complex<double> sum = 0;
    for (int k = 0; k < kHemSamples; ++k) {
      sum +=
          std::polar(radius[k], -2 * std::numbers::pi * static_cast<double>(m) * k / kHemSamples);
    }
    label.amplitude_m[m] = (m == 0 ? 1.0 : 2.0) * std::abs(sum) / kHemSamples;
  }
  label.nodes = count_folds(radius);
  return label;
}

}  // namespace drape::simulate
