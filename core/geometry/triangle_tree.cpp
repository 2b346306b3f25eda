// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/triangle_tree.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace drape {

using Eigen::Vector3d;

namespace {

constexpr int kLeaf = 4;
constexpr int kMostWaiting = 64;  // stack size: one node per level, each halves the triangles

}  // namespace

OnTriangle nearest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                               const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {a, 4};
  const Vector3d bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {b, 5};
  const Vector3d cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {c, 6};
  // A degenerate triangle has edges of zero length; either end represents such an edge.
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {d1 > d3 ? a + d1 / (d1 - d3) * ab : a, 1};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double along = d4 - d3 + d5 - d6;
    return {along > 0 ? b + (d4 - d3) / along * (c - b) : b, 2};
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {d2 > d6 ? a + d2 / (d2 - d6) * ac : a, 3};
  return {a + (vb * ab + vc * ac) / (va + vb + vc), 0};
}

TriangleTree::TriangleTree(const std::vector<Corners>& triangles) : order_(triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.emplace_back();
  build(0, 0, static_cast<int>(order_.size()), triangles);
  triangles_.reserve(order_.size());
  for (const int t : order_) triangles_.push_back(triangles[t]);
}

// The recursion depth is the logarithm of the number of triangles.
void TriangleTree::build(int node, int first, int count,  // NOLINT(misc-no-recursion)
                         const std::vector<Corners>& triangles) {
  const auto middle = [&](int t) -> Vector3d {
    return (triangles[t][0] + triangles[t][1] + triangles[t][2]) / 3;
  };
  Eigen::AlignedBox3d box, middles;
  for (int k = first; k < first + count; ++k) {
    for (const Vector3d& corner : triangles[order_[k]]) box.extend(corner);
    middles.extend(middle(order_[k]));
  }
  nodes_[node].box = box;
  if (count <= kLeaf) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  Eigen::Index axis = 0;
  middles.sizes().maxCoeff(&axis);
  const int half = count / 2;
  std::nth_element(order_.begin() + first, order_.begin() + first + half,
                   order_.begin() + first + count, [&](int s, int t) {
                     const double a = middle(s)[axis], b = middle(t)[axis];
                     return a < b || (a == b && s < t);
                   });
  const int left = static_cast<int>(nodes_.size());
  nodes_[node].left = left;
  nodes_.resize(nodes_.size() + 2);
  build(left, first, half, triangles);
  build(left + 1, first + half, count - half, triangles);
}

TriangleTree::Nearest TriangleTree::nearest(const Vector3d& point) const {
  Nearest best;
  std::array<std::pair<double, int>, kMostWaiting> waiting;  // squared distance to a box, its node
  waiting[0] = {0, 0};
  for (int count = 1; count > 0;) {
    const auto [squared, index] = waiting[--count];
    if (squared >= best.squared) continue;
    const Node& node = nodes_[index];
    if (node.count == 0) {
      std::pair<double, int> near(nodes_[node.left].box.squaredExteriorDistance(point), node.left);
      std::pair<double, int> far(nodes_[node.left + 1].box.squaredExteriorDistance(point),
                                 node.left + 1);
      if (far.first < near.first) std::swap(near, far);
      waiting[count++] = far;
      waiting[count++] = near;
      continue;
    }
    for (int k = node.first; k < node.first + node.count; ++k) {
      const auto& [a, b, c] = triangles_[k];
      const OnTriangle on = nearest_on_triangle(point, a, b, c);
      const double to_it = (on.point - point).squaredNorm();
      if (to_it < best.squared) best = {to_it, on.point, order_[k], on.feature};
    }
  }
  return best;
}

}  // namespace drape
