// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

namespace drape::simulate {

/// Merges the points of two measurements, both above 0 and increasing, from 0 to the nearer end,
/// without repetition; where one lacks a point, it is interpolated.
[[nodiscard]] inline std::vector<double> points_of_both(const std::vector<double>& a,
                                                        const std::vector<double>& b) {
  constexpr double kSame = 1e-9;  // relative to the range; closer points are the same
  const double reach = std::min(a.back(), b.back());
  std::vector<double> all;
  std::merge(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  std::vector<double> points = {0};
  for (const double x : all)
    if (x - points.back() > kSame * reach && reach - x > kSame * reach) points.push_back(x);
  points.push_back(reach);
  return points;
}

}  // namespace drape::simulate
