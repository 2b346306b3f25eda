// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <vector>

namespace drape::simulate {

/// State of a cloth on a triangle mesh, as solvers find it and the checker judges it.
struct ClothShape {
  std::vector<Eigen::Vector2d> material_m;    ///< points, (warp, weft)
  std::vector<std::array<int, 3>> triangles;  ///< turning from warp towards weft
  std::vector<std::array<int, 2>> sides;      ///< from < to; each once
  std::vector<Eigen::Vector3d> points_m;      ///< in space
  std::vector<Eigen::Vector3d> of_sides;      ///< derivative along each side's left normal
};

/// cloth.ply: vertices (x y z in mm; u v, mm along warp and weft), triangles, and an element `side`
/// (from to x y z). Little endian doubles: the forces on a point of a 2.5 mm mesh change by a
/// thousandth of its weight within 1 nm, the file takes half of the text's bytes, and the shape
/// that is read is that which was judged.
void write_cloth_shape(const std::filesystem::path& file, const ClothShape& shape);
/// Throws Error(bad_input) for a mesh without material coordinates or sides.
[[nodiscard]] ClothShape read_cloth_shape(const std::filesystem::path& file);

}  // namespace drape::simulate
