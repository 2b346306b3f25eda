// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace drape {

/// One corner of a face: a vertex and, if the file has them, its texture coordinates.
struct MeshCorner {
  std::uint32_t point = 0;
  std::uint32_t uv = 0;  ///< index into MeshFile::uvs, if these are not empty
};

/// An edge of a cloth's mesh (element `side` of a PLY): its two ends, and the derivative of the
/// position along the edge's left normal in material coordinates.
struct MeshSide {
  std::array<std::uint32_t, 2> ends{};
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
};

/// A mesh as stored in its file, in the file's own unit and axes. Faces are split into triangles.
struct MeshFile {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> uvs;  ///< empty if the file has no texture coordinates
  std::vector<std::array<MeshCorner, 3>> triangles;
  /// Row and column of each vertex; empty unless every vertex of a PLY has `row` and `col`.
  std::vector<std::array<int, 2>> lattice;
  std::vector<MeshSide> sides;  ///< empty if the file states none
};

/// Reads PLY (ASCII or binary of either byte order; texture coordinates as vertex properties s, t
/// or u, v) or OBJ (v, vt, f), selected by extension. Counts are limited to what the file's bytes
/// can hold, at most 5 million vertices and 10 million triangles. Throws Error(bad_input) naming
/// the file, and the line of a text file; a mesh without vertices is an error too unless
/// `may_be_empty`.
[[nodiscard]] MeshFile read_mesh_file(const std::filesystem::path& file, bool may_be_empty = false);

}  // namespace drape
