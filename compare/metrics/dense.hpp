// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/sheet.hpp"

#include "core/geometry/triangle_tree.hpp"

namespace drape::compare {

/// A surface of triangles in the world frame, metres.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};

/// Divides each cell of the sheet's grid that has four corners into two triangles.
[[nodiscard]] TriangleMesh mesh_of(const Sheet& sheet);

/// Finds the distance to the nearest point of a surface with a tree of boxes.
class NearestSurface {
 public:
  /// Throws Error(bad_input) if there is no triangle.
  explicit NearestSurface(const TriangleMesh& mesh);

  [[nodiscard]] double distance_m(const Eigen::Vector3d& point) const;
  [[nodiscard]] Eigen::Vector3d nearest(const Eigen::Vector3d& point) const;

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
  [[nodiscard]] double mean_m() const;       ///< mean of both directions
  [[nodiscard]] double hausdorff_m() const;  ///< maximum of both directions
};

/// Samples all vertices, and the centroids of each triangle divided into n^2 equal ones with sides
/// of at most `spacing_m`. Means weight the centroids by area; the Hausdorff distance also uses the
/// vertices and is too small by at most `spacing_m`.
[[nodiscard]] SurfaceDistance surface_distance(const TriangleMesh& first,
                                               const TriangleMesh& second, double spacing_m);

}  // namespace drape::compare
