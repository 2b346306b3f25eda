// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

namespace drape::simulate {

/// The points of two measurements, both above 0 and increasing, each once, from 0 to the nearer
/// end: what only one of them has is interpolated in the other.
[[nodiscard]] inline std::vector<double> points_of_both(const std::vector<double>& a,
                                                        const std::vector<double>& b) {
  constexpr double kSame = 1e-9;  // relative to the range: one point, up to rounding
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
