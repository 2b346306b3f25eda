// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

namespace drape::simulate {

/// Groups of points that no gap separates: the components that are left when the edges of the
/// minimum spanning tree longer than a limit are cut (single linkage). The limit is where an edge
/// is an outlier among the tree's edges: their median plus 3 times 1.4826 times their median
/// absolute deviation (Hampel 1974), at least `least`.
struct Linkage {
  double limit = 0;
  std::vector<int> group;  ///< cluster of each point; numbered as their first points come
};
[[nodiscard]] Linkage link(int count, const std::function<double(int, int)>& distance,
                           double least);

}  // namespace drape::simulate
