// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/box_tree.hpp"

#include <algorithm>
#include <numeric>

namespace drape::simulate {
namespace {

constexpr int kLeaf = 4;

}  // namespace

BoxTree::BoxTree(const std::vector<Eigen::Vector3d>& centres) : order_(centres.size()) {
  if (centres.empty()) return;
  std::iota(order_.begin(), order_.end(), 0);
  Node root;
  root.count = static_cast<int>(centres.size());
  nodes_.push_back(root);
  for (int node = 0; node < static_cast<int>(nodes_.size()); ++node) build(node, centres);
}

void BoxTree::build(int node, const std::vector<Eigen::Vector3d>& centres) {
  const int first = nodes_[node].first, count = nodes_[node].count;
  if (count <= kLeaf) return;
  Eigen::AlignedBox3d extent;
  for (int k = first; k < first + count; ++k) extent.extend(centres[order_[k]]);
  Eigen::Index axis = 0;
  extent.sizes().maxCoeff(&axis);
  const int half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](int s, int t) {
    const double a = centres[s][axis], b = centres[t][axis];
    return a < b || (a == b && s < t);
  });
  nodes_[node].left = static_cast<int>(nodes_.size());
  Node child;
  child.first = first;
  child.count = half;
  nodes_.push_back(child);
  child.first = first + half;
  child.count = count - half;
  nodes_.push_back(child);
}

void BoxTree::refit(const std::vector<Eigen::AlignedBox3d>& boxes) {
  boxes_ = boxes;
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
    node->box.setEmpty();
    if (node->left >= 0) {
      node->box = nodes_[node->left].box.merged(nodes_[node->left + 1].box);
      continue;
    }
    for (int k = node->first; k < node->first + node->count; ++k) {
      node->box.extend(boxes_[order_[k]]);
    }
  }
}

}  // namespace drape::simulate
