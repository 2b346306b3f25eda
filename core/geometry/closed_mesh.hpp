// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "core/geometry/triangle_tree.hpp"

namespace drape {

/// Closed surface of triangles with its signed distance.
class ClosedMesh {
 public:
  using Triangle = std::array<int, 3>;

  /// Corners in metres, triangles counter-clockwise seen from outside. Throws Error when the
  /// surface is not closed, not oriented, encloses nothing, or holds a value that is not finite;
  /// `name` is the file named in the error.
  ClosedMesh(std::vector<Eigen::Vector3d> corners, std::vector<Triangle> triangles,
             const std::filesystem::path& name);

  /// PLY (ASCII or binary little-endian) or OBJ, by the file's ending; millimetres. Polygons are
  /// cut into fans, corners at the same place are joined. Refuses a size that only another unit
  /// explains.
  [[nodiscard]] static ClosedMesh read(const std::filesystem::path& file);

  struct Distance {
    double gap_m = 0;                                   ///< negative inside
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, outwards
    int face = -1;  ///< triangle whose inside the nearest point is in; -1: an edge or a corner
  };
  /// Nearest point of the surface; the sign by the angle-weighted pseudo-normal of the feature it
  /// lies on (Baerentzen and Aanaes 2005), which is exact for closed surfaces.
  [[nodiscard]] Distance distance(const Eigen::Vector3d& point) const;

  [[nodiscard]] const std::vector<Eigen::Vector3d>& corners() const { return corners_; }
  [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }

 private:
  void check_closed(const std::filesystem::path& name);

  std::vector<Eigen::Vector3d> corners_;
  std::vector<Triangle> triangles_;
  std::vector<Eigen::Vector3d> face_normal_, corner_normal_;
  std::vector<std::array<Eigen::Vector3d, 3>> edge_normal_;  ///< normal at edge k -> k + 1
  TriangleTree tree_;
};

}  // namespace drape
