// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <vector>

namespace drape::simulate {

/// Closed surface of triangles with its signed distance.
class TriangleMesh {
 public:
  using Triangle = std::array<int, 3>;

  /// Corners in metres, triangles counter-clockwise seen from outside. Throws Error when the
  /// surface is not closed, not oriented, encloses nothing, or holds a value that is not finite;
  /// `name` is the file named in the error.
  TriangleMesh(std::vector<Eigen::Vector3d> corners, std::vector<Triangle> triangles,
               const std::filesystem::path& name);

  /// PLY (ASCII or binary little-endian) or OBJ, by the file's ending; millimetres. Polygons are
  /// cut into fans, corners at the same place are joined. Refuses a size that only another unit
  /// explains.
  [[nodiscard]] static TriangleMesh read(const std::filesystem::path& file);

  struct Distance {
    double gap_m = 0;                                   ///< negative inside
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, outwards
  };
  /// Nearest surface point by a tree of boxes; the sign by the angle-weighted pseudo-normal of the
  /// feature it lies on (Baerentzen and Aanaes 2005), which is exact for closed surfaces.
  [[nodiscard]] Distance distance(const Eigen::Vector3d& point) const;

  [[nodiscard]] const std::vector<Eigen::Vector3d>& corners() const { return corners_; }
  [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int first = 0, count = 0;  ///< triangles of a leaf; count 0: children at left and left + 1
    int left = 0;
  };
  struct Nearest;
  void check_closed(const std::filesystem::path& name);
  void build(int node, int first, int count);
  void search(int node, const Eigen::Vector3d& point, Nearest& nearest) const;

  std::vector<Eigen::Vector3d> corners_;
  std::vector<Triangle> triangles_;
  std::vector<Eigen::Vector3d> face_normal_, corner_normal_;
  std::vector<std::array<Eigen::Vector3d, 3>> edge_normal_;  ///< of edge k -> k + 1
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace drape::simulate
