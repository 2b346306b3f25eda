// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

namespace drape::simulate {

/// Tree of axis-aligned boxes over items 0 .. n - 1, for overlap queries. Its structure is derived
/// from the items' centres once; the boxes may move later.
class BoxTree {
 public:
  BoxTree() = default;
  explicit BoxTree(const std::vector<Eigen::Vector3d>& centres);

  /// Updates the items' boxes.
  void refit(const std::vector<Eigen::AlignedBox3d>& boxes);

  /// Calls visit(item) for every item whose box overlaps `box`, in an order that depends on the
  /// centres only.
  template <class Visit>
  void query(const Eigen::AlignedBox3d& box, Visit visit) const {
    if (!nodes_.empty()) search(0, box, visit);
  }

  /// Calls visit(one, other) once for every pair of items with overlapping boxes, the lower number
  /// first, in an order that depends on the centres only.
  template <class Visit>
  void query_pairs(Visit visit) const {
    if (!nodes_.empty()) search_pairs(0, 0, visit);
  }

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int first = 0, count = 0;  ///< range of order_; a leaf has no children
    int left = -1;             ///< index of the left child; the right one is left + 1
  };

  template <class Visit>
  void search(int node, const Eigen::AlignedBox3d& box, Visit& visit) const {
    const Node& here = nodes_[node];
    if (!here.box.intersects(box)) return;
    if (here.left >= 0) {
      search(here.left, box, visit);
      search(here.left + 1, box, visit);
      return;
    }
    for (int k = here.first; k < here.first + here.count; ++k) {
      if (boxes_[order_[k]].intersects(box)) visit(order_[k]);
    }
  }

  template <class Visit>
  void search_pairs(int one, int two, Visit& visit) const {
    const Node &a = nodes_[one], &b = nodes_[two];
    if (one != two && !a.box.intersects(b.box)) return;
    if (a.left < 0 && b.left < 0) {
      for (int k = a.first; k < a.first + a.count; ++k) {
        for (int l = one == two ? k + 1 : b.first; l < b.first + b.count; ++l) {
          const int s = order_[k], t = order_[l];
          if (boxes_[s].intersects(boxes_[t])) visit(std::min(s, t), std::max(s, t));
        }
      }
      return;
    }
    if (one == two) {
      search_pairs(a.left, a.left, visit);
      search_pairs(a.left + 1, a.left + 1, visit);
      search_pairs(a.left, a.left + 1, visit);
    } else if (a.left >= 0 && (b.left < 0 || a.count >= b.count)) {
      search_pairs(a.left, two, visit);
      search_pairs(a.left + 1, two, visit);
    } else {
      search_pairs(one, b.left, visit);
      search_pairs(one, b.left + 1, visit);
    }
  }
  void build(int node, const std::vector<Eigen::Vector3d>& centres);

  std::vector<Node> nodes_;  ///< children come after their parent
  std::vector<int> order_;
  std::vector<Eigen::AlignedBox3d> boxes_;
};

}  // namespace drape::simulate
