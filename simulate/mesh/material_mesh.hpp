// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <vector>

namespace drape::simulate {

using Polygon = std::vector<Eigen::Vector2d>;

/// Outline of a piece of cloth in material coordinates (warp, weft), metres.
struct ClothOutline {
  Polygon outer;
  std::vector<Polygon> holes;
  /// Closed lines inside that triangles do not cross, such as the rim of a clamping disc.
  std::vector<Polygon> creases;
  /// Material points that become points of the mesh, such as pins; on a line it is cut there.
  std::vector<Eigen::Vector2d> points = {};
  /// Straight lines on the cloth that triangles do not cross, such as clamps; also along the
  /// border.
  std::vector<std::array<Eigen::Vector2d, 2>> lines = {};
  std::filesystem::path file = {};  ///< that it was read from; empty: none
};

/// True if a point lies inside a closed polygon of either sense.
[[nodiscard]] bool contains(const Polygon& polygon, const Eigen::Vector2d& point_m);
/// Distance (m) of a point from the nearest line of a closed polygon.
[[nodiscard]] double distance_m(const Polygon& polygon, const Eigen::Vector2d& point_m);
/// True if a point lies on the cloth or no farther than `near_m` beside its border.
[[nodiscard]] bool is_on(const ClothOutline& outline, const Eigen::Vector2d& point_m,
                         double near_m);

/// `count` corners on a circle, one at angle `turn_rad` from the warp.
[[nodiscard]] Polygon circle(const Eigen::Vector2d& centre_m, double radius_m, int count,
                             double turn_rad = 0);

/// A flat triangle mesh in material coordinates. Triangles turn from warp towards weft.
struct MaterialMesh {
  std::vector<Eigen::Vector2d> points_m;
  std::vector<std::array<int, 3>> triangles;
  struct Edge {
    int from = 0, to = 0;       ///< from < to
    int left = -1, right = -1;  ///< triangles beside it; -1: none
  };
  std::vector<Edge> edges;                   ///< ordered by (from, to)
  std::vector<std::array<int, 3>> edges_of;  ///< per triangle: edge k lies opposite corner k

  [[nodiscard]] double area_m2(int triangle) const;
  [[nodiscard]] double area_m2() const;
  [[nodiscard]] double mean_side_m() const;
  [[nodiscard]] double border_m() const;  ///< length of the edges that have one triangle
};

/// Edges and neighbours of triangles. Throws Error(bad_input) for an edge with more than two
/// triangles, a triangle without area, or an index that is not a point's.
[[nodiscard]] MaterialMesh mesh_of(std::vector<Eigen::Vector2d> points_m,
                                   std::vector<std::array<int, 3>> triangles);

struct MeshOptions {
  double spacing_m = 0.01;      ///< spacing of points, on lines and inside
  double lattice_turn_rad = 0;  ///< angle of the hexagonal lattice inside, from the warp
  double jitter = 0.1;          ///< in spacings; keeps folds from choosing the lattice
  unsigned seed = 1;
  int smoothing = 3;  ///< rounds in which inner points move to the middle of their neighbours
};

/// Lines are cut into pieces of the spacing, the inside is filled with a hexagonal lattice, and all
/// points are joined by a Delaunay triangulation (Bowyer and Watson 1981), of which what lies
/// outside the outline or in holes is left out. Lines become sides of the mesh. Throws
/// Error(bad_input) for an outline with fewer than three corners, without area, or finer than the
/// spacing can follow: area and border of the mesh are those of the outline.
[[nodiscard]] MaterialMesh triangulated(const ClothOutline& outline, const MeshOptions& options);

/// Corners of the outer border, in its order.
[[nodiscard]] std::vector<int> border_of(const MaterialMesh& mesh);

/// Delaunay triangles of points, in any order, counter-clockwise.
[[nodiscard]] std::vector<std::array<int, 3>> delaunay(const std::vector<Eigen::Vector2d>& points);

}  // namespace drape::simulate
