// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

namespace drape::simulate {

/// Single-linkage clusters: the components that remain after removing edges of the minimum
/// spanning tree longer than a limit. The limit is where an edge is an outlier: median plus 3
/// times 1.4826 times the median absolute deviation of the tree's edges (Hampel 1974), at least
/// `least`.
struct Linkage {
  double limit = 0;
  std::vector<int> group;  ///< cluster of each point, numbered by first occurrence
};
[[nodiscard]] Linkage link(int count, const std::function<double(int, int)>& distance,
                           double least);

}  // namespace drape::simulate
