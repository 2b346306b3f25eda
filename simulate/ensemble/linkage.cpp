// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/linkage.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "core/statistics/sample.hpp"

namespace drape::simulate {
namespace {

/// Median plus three robust standard deviations.
double outlier_limit(std::vector<double> values) {
  const double middle = median(values);
  for (double& value : values) value = std::abs(value - middle);
  return middle + 3 * 1.4826 * median(values);
}

/// An edge of a spanning tree.
struct Edge {
  int from = 0, to = 0;
  double length = 0;
};

/// Minimum spanning tree (Prim 1957).
std::vector<Edge> spanning_tree(int count, const std::function<double(int, int)>& distance) {
  std::vector<Edge> tree, nearest;
  for (int i = 1; i < count; ++i) nearest.push_back({0, i, distance(0, i)});
  while (!nearest.empty()) {
    const auto next =
        std::min_element(nearest.begin(), nearest.end(),
                         [](const Edge& a, const Edge& b) { return a.length < b.length; });
    const Edge edge = *next;
    nearest.erase(next);
    tree.push_back(edge);
    for (Edge& other : nearest) {
      const double length = distance(edge.to, other.to);
      if (length < other.length) other = {edge.to, other.to, length};
    }
  }
  return tree;
}

}  // namespace

Linkage link(int count, const std::function<double(int, int)>& distance, double least) {
  Linkage linkage{least, std::vector<int>(count)};
  const std::vector<Edge> tree = spanning_tree(count, distance);
  std::vector<double> lengths;
  lengths.reserve(tree.size());
  for (const Edge& edge : tree) lengths.push_back(edge.length);
  if (!lengths.empty()) linkage.limit = std::max(least, outlier_limit(lengths));
  std::iota(linkage.group.begin(), linkage.group.end(), 0);
  for (const Edge& edge : tree) {
    if (edge.length > linkage.limit) continue;
    const int from = linkage.group[edge.from], to = linkage.group[edge.to];
    std::replace(linkage.group.begin(), linkage.group.end(), std::max(from, to),
                 std::min(from, to));
  }
  std::vector<int> number(count, -1);
  int groups = 0;
  for (int& one : linkage.group) {
    if (number[one] < 0) number[one] = groups++;
    one = number[one];
  }
  return linkage;
}

}  // namespace drape::simulate
