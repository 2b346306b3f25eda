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

/// Two triangles for each cell of the sheet's grid whose four corners exist.
[[nodiscard]] TriangleMesh mesh_of(const Sheet& sheet);

/// Answers "how far is the nearest point of the surface" through a tree of boxes.
class NearestSurface {
 public:
  /// Throws Error(bad_input) without a triangle.
  explicit NearestSurface(const TriangleMesh& mesh);

  [[nodiscard]] double distance_m(const Eigen::Vector3d& point) const;
  [[nodiscard]] Eigen::Vector3d nearest(const Eigen::Vector3d& point) const;

 private:
  TriangleTree tree_;
};

/// Distances from one surface to another, in one direction.
struct OneDirection {
  double mean_m = 0;       ///< over the area
  double rms_m = 0;        ///< over the area
  double hausdorff_m = 0;  ///< largest, at the samples
};

/// Distance of two surfaces without knowing which point belongs to which. It is always at
/// most the distance of corresponding points: cloth that slid along itself has none.
struct SurfaceDistance {
  OneDirection first_to_second, second_to_first;
  [[nodiscard]] double mean_m() const;       ///< mean of both directions
  [[nodiscard]] double hausdorff_m() const;  ///< larger of both directions
};

/// Samples: all vertices, and the centroids of each triangle cut into n^2 equal ones, so that their
/// sides are at most `spacing_m`. The means weigh the centroids by area; the Hausdorff distance
/// also looks at the vertices and misses at most `spacing_m`.
[[nodiscard]] SurfaceDistance surface_distance(const TriangleMesh& first,
                                               const TriangleMesh& second, double spacing_m);

}  // namespace drape::compare
