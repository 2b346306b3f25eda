// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/triangle_tree.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// A point of a sheet with its local frame; world frame, metres.
struct SurfacePoint {
  Eigen::Vector3d point_in_world;
  Eigen::Vector3d along_warp;  ///< unit tangent in the direction of increasing rows
  Eigen::Vector3d along_weft;  ///< unit tangent in the direction of increasing columns
  Eigen::Vector3d normal;      ///< unit normal on the printed side: warp cross weft
};

/// A sheet as a surface over material coordinates: bilinear on each cell of the particle grid. The
/// warp coordinate must depend on the row only and the weft coordinate on the column only.
class Surface {
 public:
  /// `file` names the sheet in errors. Throws Error(bad_input) if the points do not form a grid or
  /// there are fewer than 2x2.
  Surface(const Sheet& sheet, const std::string& file);

  /// nullopt outside the grid (1 nm tolerance), in a cell with a missing corner, or if the cell is
  /// degenerate and has no normal.
  [[nodiscard]] std::optional<SurfacePoint> at(const Eigen::Vector2d& material_m) const;

 private:
  [[nodiscard]] const std::optional<Eigen::Vector3d>& point(std::size_t row, std::size_t col) const;

  std::vector<double> warp_m_;  ///< material coordinate of each row
  std::vector<double> weft_m_;  ///< material coordinate of each column
  std::vector<std::optional<Eigen::Vector3d>> points_;
};

/// Material coordinates of every mark of a lattice, including gaps, derived from the marks that
/// have a position: the coordinates are linear in row and column. nullopt if fewer than two rows or
/// columns are measured. Throws Error(bad_input) if the marks are not on such a lattice.
class LatticeCoordinates {
 public:
  [[nodiscard]] static std::optional<LatticeCoordinates> of(const Sheet& sheet,
                                                            const std::string& file);
  [[nodiscard]] Eigen::Vector2d at(MarkId mark) const;

 private:
  Eigen::Vector2d origin_m_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d pitch_m_ = Eigen::Vector2d::Zero();
};

/// A surface of triangles in the world frame, metres.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};

[[nodiscard]] double area_m2(const TriangleMesh& mesh);

/// Divides each cell of the sheet's grid that has four corners into two triangles.
[[nodiscard]] TriangleMesh mesh_of(const Sheet& sheet);

/// Finds the distance to the nearest point of a surface with a tree of boxes.
class NearestSurface {
 public:
  /// Throws Error(bad_input) if there is no triangle.
  explicit NearestSurface(const TriangleMesh& mesh);

  [[nodiscard]] double distance_m(const Eigen::Vector3d& point) const {
    return (nearest(point) - point).norm();
  }
  [[nodiscard]] Eigen::Vector3d nearest(const Eigen::Vector3d& point) const {
    return tree_.nearest(point).point;
  }

 private:
  TriangleTree tree_;
};

/// Distances from one surface to another in one direction.
struct OneDirection {
  double mean_m = 0;       ///< area-weighted
  double rms_m = 0;        ///< area-weighted
  double hausdorff_m = 0;  ///< maximum over the samples
};

/// Distance of two surfaces without point correspondence. It never exceeds the distance of
/// corresponding points: sliding of the cloth along itself does not count.
struct SurfaceDistance {
  OneDirection first_to_second, second_to_first;
  [[nodiscard]] double mean_m() const {  ///< mean of both directions
    return 0.5 * (first_to_second.mean_m + second_to_first.mean_m);
  }
  [[nodiscard]] double hausdorff_m() const {  ///< maximum of both directions
    return std::max(first_to_second.hausdorff_m, second_to_first.hausdorff_m);
  }
};

/// Samples all vertices, and the centroids of each triangle divided into n^2 equal ones with sides
/// of at most `spacing_m`. Means weight the centroids by area; the Hausdorff distance also uses the
/// vertices and is too small by at most `spacing_m`.
[[nodiscard]] SurfaceDistance surface_distance(const TriangleMesh& first,
                                               const TriangleMesh& second, double spacing_m);

}  // namespace drape::compare
