// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace drape::simulate {

/// Tree of axis-parallel boxes over items 0 .. n - 1, for "which items are near this box". Its
/// shape comes from the items' centres once; the boxes may move afterwards.
class BoxTree {
 public:
  BoxTree() = default;
  explicit BoxTree(const std::vector<Eigen::Vector3d>& centres);

  /// Sets the items' boxes.
  void refit(const std::vector<Eigen::AlignedBox3d>& boxes);

  /// Calls visit(item) for every item whose box meets `box`, in an order that depends on the
  /// centres alone.
  template <class Visit>
  void query(const Eigen::AlignedBox3d& box, Visit visit) const {
    if (!nodes_.empty()) search(0, box, visit);
  }

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int first = 0, count = 0;  ///< of order_; a leaf has no children
    int left = -1;             ///< children left and left + 1
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
  void build(int node, const std::vector<Eigen::Vector3d>& centres);

  std::vector<Node> nodes_;  ///< children after their parent
  std::vector<int> order_;
  std::vector<Eigen::AlignedBox3d> boxes_;
};

}  // namespace drape::simulate
