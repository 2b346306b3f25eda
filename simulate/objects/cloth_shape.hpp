// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <vector>

namespace drape::simulate {

/// Shape of a cloth on a triangle mesh, shared by solvers and checker.
struct ClothShape {
  std::vector<Eigen::Vector2d> material_m;    ///< (warp, weft) of the points
  std::vector<std::array<int, 3>> triangles;  ///< oriented from warp to weft
  std::vector<std::array<int, 2>> sides;      ///< from < to; without repetition
  std::vector<Eigen::Vector3d> points_m;      ///< in space
  std::vector<Eigen::Vector3d> of_sides;      ///< derivative along each side's left normal
};

/// Writes cloth.ply: vertices (x y z in mm; u v, mm along warp and weft), triangles, and an element
/// `side` (from to x y z). Little-endian doubles are used because the forces on a point of a 2.5 mm
/// mesh change by a thousandth of its weight within 1 nm; the file has half the size of text, and
/// the shape read back is exactly the one judged.
void write_cloth_shape(const std::filesystem::path& file, const ClothShape& shape);
/// Throws Error(bad_input) for a mesh without material coordinates or sides.
[[nodiscard]] ClothShape read_cloth_shape(const std::filesystem::path& file);

}  // namespace drape::simulate
