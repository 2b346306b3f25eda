// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "simulate/fabric/fabric.hpp"

namespace drape::simulate {

/// Shape of a cloth on a triangle mesh, shared by solvers and checker.
struct ClothShape {
  std::vector<Eigen::Vector2d> material_m;    ///< (warp, weft) of the points
  std::vector<std::array<int, 3>> triangles;  ///< oriented from warp to weft
  std::vector<std::array<int, 2>> sides;      ///< from < to; without repetition
  std::vector<Eigen::Vector3d> points_m;      ///< in space
  std::vector<Eigen::Vector3d> of_sides;      ///< derivative along each edge's left normal
};

/// Writes cloth.ply: vertices (x y z in mm; u v, mm along warp and weft), triangles, and an element
/// `side` (from to x y z) for the edges. Uses little-endian doubles: the forces on a point of a 2.5
/// mm mesh change by a thousandth of its weight within 1 nm. The file has half the size of text and
/// reads back exactly the shape that was judged.
void write_cloth_shape(const std::filesystem::path& file, const ClothShape& shape);
/// Reads cloth.ply. Throws Error(bad_input) for a mesh without material coordinates or edges.
[[nodiscard]] ClothShape read_cloth_shape(const std::filesystem::path& file);

/// Contact force of an object or the table at one point of the sheet, a weighted sum of up to four
/// nodes, as found by the solver; or the force between two layers, where the nodes of the second
/// have negative weights. A checker thus verifies contacts without finding them.
struct ContactForce {
  /// Index of the scene's obstacle; their number is the table, the next one the sheet itself.
  int shape = 0;
  std::array<int, 4> particle{};
  std::array<double, 4> weight{};
  Eigen::Vector3d force_in_world = Eigen::Vector3d::Zero();  ///< N
};

/// Content of contact_forces.csv. Reading throws Error(bad_input) for an index that is not a
/// non-negative integer.
[[nodiscard]] std::string contact_forces_csv(const std::vector<ContactForce>& forces);
[[nodiscard]] std::vector<ContactForce> read_contact_forces(const std::filesystem::path& file);

/// All input files of a drape: scene, print, fabric with its curves, meshes of the objects.
[[nodiscard]] std::vector<std::filesystem::path> files_of(const Scene& scene, const Fabric& fabric);

}  // namespace drape::simulate
