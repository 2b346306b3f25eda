// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace drape {

/// One corner of a face: a vertex and, where the file has them, its texture coordinates.
struct MeshCorner {
  std::uint32_t point = 0;
  std::uint32_t uv = 0;  ///< index into MeshFile::uvs; only when these are not empty
};

/// A side of a cloth's mesh (element `side` of a PLY): its ends, and the derivative of the place
/// along its left normal in material coordinates.
struct MeshSide {
  std::array<std::uint32_t, 2> ends{};
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
};

/// A mesh as the file holds it, in the file's own unit and axes. Faces are cut into triangles.
struct MeshFile {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> uvs;  ///< empty: the file has no texture coordinates
  std::vector<std::array<MeshCorner, 3>> triangles;
  /// Row and column of each vertex; empty unless every vertex of a PLY has `row` and `col`.
  std::vector<std::array<int, 2>> lattice;
  std::vector<MeshSide> sides;  ///< empty: the file states none
};

/// Reads PLY (ascii, binary of either byte order; texture coordinates as vertex properties s, t or
/// u, v) or OBJ (v, vt, f), by the name's end. Counts are believed only as far as the file's bytes
/// can hold them; at most 5 million vertices and 10 million triangles. Throws Error(bad_input)
/// naming the file, and the line where it is text; a mesh without a vertex too unless that is asked
/// for.
[[nodiscard]] MeshFile read_mesh_file(const std::filesystem::path& file, bool may_be_empty = false);

}  // namespace drape
