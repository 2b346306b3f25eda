// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "core/geometry/triangle_tree.hpp"

namespace drape {

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
