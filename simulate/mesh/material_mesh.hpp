// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <vector>

namespace drape::simulate {

using Polygon = std::vector<Eigen::Vector2d>;

/// Outline of a piece of cloth in material coordinates (warp, weft), in metres.
struct ClothOutline {
  Polygon outer;
  std::vector<Polygon> holes;
  /// Closed lines inside that triangles must not cross, such as the rim of a clamping disc.
  std::vector<Polygon> creases;
  /// Material points that become mesh points, such as pins; they split a line on which they lie.
  std::vector<Eigen::Vector2d> points = {};
  /// Straight lines on the cloth that triangles must not cross, such as clamps; may follow the
  /// border.
  std::vector<std::array<Eigen::Vector2d, 2>> lines = {};
  std::filesystem::path file = {};  ///< file it was read from; empty if none
};

[[nodiscard]] Eigen::AlignedBox2d box_of(const std::vector<Eigen::Vector2d>& points);
/// True if a point lies inside a closed polygon of either orientation.
[[nodiscard]] bool contains(const Polygon& polygon, const Eigen::Vector2d& point_m);
/// Distance (m) of a point from the nearest edge of a closed polygon.
[[nodiscard]] double distance_m(const Polygon& polygon, const Eigen::Vector2d& point_m);
/// True if a point lies on the cloth or at most `near_m` outside its border.
[[nodiscard]] bool is_on(const ClothOutline& outline, const Eigen::Vector2d& point_m,
                         double near_m);

/// Regular polygon of `count` corners on a circle, one of them at angle `turn_rad` from the warp.
[[nodiscard]] Polygon circle(const Eigen::Vector2d& centre_m, double radius_m, int count,
                             double turn_rad = 0);

/// A flat triangle mesh in material coordinates. Triangles are oriented from warp to weft.
struct MaterialMesh {
  std::vector<Eigen::Vector2d> points_m;
  std::vector<std::array<int, 3>> triangles;
  struct Edge {
    int from = 0, to = 0;       ///< from < to
    int left = -1, right = -1;  ///< adjacent triangles; -1 for none
  };
  std::vector<Edge> edges;                   ///< ordered by (from, to)
  std::vector<std::array<int, 3>> edges_of;  ///< for each triangle; edge k is opposite corner k

  [[nodiscard]] double area_m2(int triangle) const;
  [[nodiscard]] double area_m2() const;
  [[nodiscard]] double mean_side_m() const;
  [[nodiscard]] double border_m() const;  ///< total length of edges with a single triangle
};

/// Determines edges and neighbours of triangles. Throws Error(bad_input) for an edge with more than
/// two triangles, a triangle without area, or an invalid point index.
[[nodiscard]] MaterialMesh mesh_of(std::vector<Eigen::Vector2d> points_m,
                                   std::vector<std::array<int, 3>> triangles);

struct MeshOptions {
  double spacing_m = 0.01;      ///< spacing of points on lines and inside
  double lattice_turn_rad = 0;  ///< angle of the interior hexagonal lattice from the warp
  double jitter = 0.1;          ///< in spacings; keeps folds from aligning with the lattice
  unsigned seed = 1;
  int smoothing = 3;  ///< smoothing passes, which move inner points to their neighbours' mean
};

/// Meshes an outline: lines are divided at the spacing, the interior is filled with a hexagonal
/// lattice, and all points are joined by a Delaunay triangulation (Bowyer and Watson 1981), from
/// which triangles outside the outline or in holes are removed. Lines become edges of the mesh.
/// Throws Error(bad_input) for an outline with fewer than three corners, without area, or too fine
/// for the spacing: the mesh must have the outline's area and border.
[[nodiscard]] MaterialMesh triangulated(const ClothOutline& outline, const MeshOptions& options);

/// Corners of the outer border, in order.
[[nodiscard]] std::vector<int> border_of(const MaterialMesh& mesh);

/// Delaunay triangles of points given in any order, counter-clockwise.
[[nodiscard]] std::vector<std::array<int, 3>> delaunay(const std::vector<Eigen::Vector2d>& points);

}  // namespace drape::simulate
