// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <vector>

namespace drape {

/// Nearest point on a triangle a, b, c, and the feature it lies on: 0 the face, 1 to 3 the edges
/// ab, bc, ca, 4 to 6 the corners (Ericson, Real-Time Collision Detection, 2005, 5.1.5).
struct OnTriangle {
  Eigen::Vector3d point;
  int feature = 0;
};
[[nodiscard]] OnTriangle nearest_on_triangle(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                                             const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Tree of bounding boxes over triangles; finds the nearest of n in about log n steps.
class TriangleTree {
 public:
  using Corners = std::array<Eigen::Vector3d, 3>;

  TriangleTree() = default;
  /// Needs at least one triangle.
  explicit TriangleTree(const std::vector<Corners>& triangles);

  struct Nearest {
    double squared = std::numeric_limits<double>::infinity();  ///< squared distance, m^2
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    int triangle = 0;  ///< index in the order given
    int feature = 0;   ///< weights, see OnTriangle
  };
  [[nodiscard]] Nearest nearest(const Eigen::Vector3d& point) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int first = 0, count = 0;  ///< triangles of a leaf; count 0: inner node, children left, left+1
    int left = 0;
  };
  void build(int node, int first, int count, const std::vector<Corners>& triangles);

  std::vector<int> order_;
  std::vector<Corners> triangles_;  ///< in the order of the leaves
  std::vector<Node> nodes_;
};

}  // namespace drape
