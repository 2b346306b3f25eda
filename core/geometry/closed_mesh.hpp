// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <filesystem>
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

/// Closed triangle surface with a signed distance function.
class ClosedMesh {
 public:
  using Triangle = std::array<int, 3>;

  /// Corners in metres; triangles counter-clockwise seen from outside. Throws Error if the surface
  /// is not closed, is inconsistently oriented, encloses no volume, or holds a value that is not
  /// finite; `name` is the file named in the error.
  ClosedMesh(std::vector<Eigen::Vector3d> corners, std::vector<Triangle> triangles,
             const std::filesystem::path& name);

  /// Reads PLY (ASCII or binary little-endian) or OBJ, selected by extension, in millimetres.
  /// Polygons are split into fans and coincident corners are merged. Throws for a size that
  /// suggests another unit.
  [[nodiscard]] static ClosedMesh read(const std::filesystem::path& file);

  struct Distance {
    double gap_m = 0;                                   ///< negative inside
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit vector, outwards
    int face = -1;  ///< triangle whose interior holds the nearest point; -1 for an edge or a corner
  };
  /// Nearest point of the surface. The sign follows from the angle-weighted pseudo-normal of its
  /// face, edge or corner (Baerentzen and Aanaes 2005), which is exact for closed surfaces.
  [[nodiscard]] Distance distance(const Eigen::Vector3d& point) const;

  [[nodiscard]] const std::vector<Eigen::Vector3d>& corners() const { return corners_; }
  [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }

 private:
  void check_closed(const std::filesystem::path& name);

  std::vector<Eigen::Vector3d> corners_;
  std::vector<Triangle> triangles_;
  std::vector<Eigen::Vector3d> face_normal_, corner_normal_;
  std::vector<std::array<Eigen::Vector3d, 3>> edge_normal_;  ///< normal at the edge from k to k + 1
  TriangleTree tree_;
};

}  // namespace drape
