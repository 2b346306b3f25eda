// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::test {

/// The paper's scene A with the warp's curves also in the weft, so that cloth, object and start
/// have the symmetry of the square and any asymmetry of a drape is due to the discretisation.
struct SphereScene {
  Scene scene;
  Print print;
  simulate::Fabric fabric;
};
[[nodiscard]] SphereScene read_sphere_scene();

struct SphereDrape {
  bool at_rest = false;
  std::vector<Eigen::Vector3d> points_m;  ///< in world; warp along -y, weft along +x
  std::vector<std::vector<int>> faces;    ///< corners in order
  std::vector<int> hem;                   ///< border points in order
  int side = 0;                           ///< material marks along warp and along weft
  std::vector<Eigen::Vector3d> marks_m;   ///< side x side positions in world, rows along the warp
  [[nodiscard]] const Eigen::Vector3d& mark(int row, int col) const {
    return marks_m[static_cast<std::size_t>(row) * side + col];
  }
};

/// Drape of the paper's model on `side` x `side` particles, without waves in the start.
[[nodiscard]] SphereDrape drape_grid(const SphereScene& scene, int side);

/// Drape of a triangle mesh with friction on the sphere, from the same start; marks every patch /
/// (side - 1). `in_triangles` is MeshCloth's.
[[nodiscard]] SphereDrape drape_mesh(const SphereScene& scene, simulate::MaterialMesh mesh,
                                     double in_triangles, int side);

/// Squares of the patch, each cut along the diagonal from its corner of lowest warp and weft.
[[nodiscard]] simulate::MaterialMesh one_diagonal_mesh(const Print& print, int side);
/// Mesh of the project's mesher at the same spacing; `seed` selects its jitter.
[[nodiscard]] simulate::MaterialMesh irregular_mesh(const Print& print, int side,
                                                    unsigned seed = 1);

/// Root mean square distance (mm) of marks from the mirror images of their mirror marks.
struct Asymmetry {
  double middle_mm = 0;    ///< mirror u -> -u, along the warp, which exchanges the diagonals
  double diagonal_mm = 0;  ///< mirror u <-> v, which keeps both diagonals
};
[[nodiscard]] Asymmetry asymmetry(const SphereDrape& drape);

/// Mean height (mm) of the marks above the sphere's centre, and the area inside the hem seen from
/// above as a fraction of the flat patch.
[[nodiscard]] double mean_height_mm(const SphereScene& scene, const SphereDrape& drape);
[[nodiscard]] double plan_area(const SphereScene& scene, const SphereDrape& drape);

[[nodiscard]] const Sphere& sphere_of(const SphereScene& scene);

}  // namespace drape::test
