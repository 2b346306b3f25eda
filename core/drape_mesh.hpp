// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"

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

enum class MeshUp { z, y };
template <>
inline constexpr std::string_view names_of<MeshUp>[] = {"z", "y"};
enum class ClothDirection { warp, weft };
template <>
inline constexpr std::string_view names_of<ClothDirection>[] = {"warp", "weft"};
enum class TextureDirection { u, v };
template <>
inline constexpr std::string_view names_of<TextureDirection>[] = {"u", "v"};
enum class Correspondence { none };
template <>
inline constexpr std::string_view names_of<Correspondence>[] = {"none"};

/// Material coordinates (warp, weft), in metres, at the two ends of a grid or of the texture range.
struct MaterialRange {
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero(), to_m = Eigen::Vector2d::Zero();

  /// Interpolates; `part` runs from 0 to 1 along warp and weft.
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& part) const {
    return from_m + part.cwiseProduct(to_m - from_m);
  }
};
struct VertexGrid {
  ClothDirection inner = ClothDirection::weft;  ///< direction in which the vertex index grows by 1
  int inner_count = 0;
  MaterialRange range;
};
struct TextureMap {
  TextureDirection warp = TextureDirection::v;  ///< texture coordinate that runs along the warp
  MaterialRange range;
};

/// Drape that another program made, from a small file that people write beside its mesh:
///
///     name = "Blender 3.4"          the simulator, as it shall stand in the tables
///     mesh = "mesh_A.ply"           .ply or .obj
///     unit_mm = 1.0                 length of one unit of the mesh
///     up = "z"                      or "y": z_world = y_mesh, y_world = -z_mesh
///     scene = "A"                   as the scenes of the simulations it stands beside
///     fabric = "cotton-like"        optional
///     correspondence = "none"       only when nothing of the next two is known
///     [grid]                        vertices in rows, or instead
///     inner = "weft"                direction along which the index grows by one
///     inner_count = 111
///     warp_from_mm = 220.0          material coordinate at the first vertex ...
///     warp_to_mm = 0.0              ... and at the last
///     weft_from_mm = 0.0
///     weft_to_mm = 220.0
///     [uv]                          texture coordinates
///     warp = "v"                    which one runs along the warp
///     warp_from_mm = 220.0          material coordinate where it is 0 ...
///     warp_to_mm = 0.0              ... and 1
///     weft_from_mm = 0.0
///     weft_to_mm = 220.0
struct DrapeMesh {
  Document document;
  std::string name, scene;
  std::filesystem::path mesh_file;
  double unit_m = 0;
  MeshUp up = MeshUp::z;
  std::optional<std::string> fabric;
  std::optional<Correspondence> correspondence;
  std::optional<VertexGrid> grid;
  std::optional<TextureMap> uv;

  MeshFile mesh;                                 ///< filled in by read_drape_mesh()
  std::vector<Eigen::Vector3d> points_in_world;  ///< vertices of `mesh`

  /// Throws Error(bad_input) at the given field of the description.
  [[noreturn]] void reject(const char* field, const std::string& what,
                           const std::string& remedy) const;
  /// Number of vertices of a [grid] along its outer direction.
  [[nodiscard]] int outer_count() const;
  /// Material coordinates of the [grid] vertex with the given indices.
  [[nodiscard]] Eigen::Vector2d material_m(int inner, int outer) const;
};
template <>
inline constexpr Format format_of<DrapeMesh>{"mesh", Syntax::toml, 1,
                                             "mesh of a drape that another program made"};
void fields(Fields& f, DrapeMesh& drape);

/// Reads the description and its mesh, or `mesh` instead of the named file if given. Throws
/// Error(bad_input) naming file and field.
[[nodiscard]] DrapeMesh read_drape_mesh(const std::filesystem::path& file,
                                        const std::filesystem::path& mesh = {});

/// Surface of a mesh as a function of material coordinates, linear on each triangle.
class MaterialSurface {
 public:
  /// `tolerance`: distance outside a triangle that still counts as on it, relative to its size.
  MaterialSurface(const DrapeMesh& drape, double tolerance);
  /// World point of the first triangle that contains the coordinates; nullopt if none does.
  [[nodiscard]] std::optional<Eigen::Vector3d> at(const Eigen::Vector2d& material_m) const;

 private:
  struct Piece {
    Eigen::Matrix2d to_weights;  ///< from material offset to two barycentric weights
    std::array<Eigen::Vector2d, 3> material_m;
    std::array<Eigen::Vector3d, 3> in_world;
  };
  void add(const std::array<Eigen::Vector2d, 3>& material_m,
           const std::array<Eigen::Vector3d, 3>& in_world);
  void add_grid(const DrapeMesh& drape);
  void add_texture(const DrapeMesh& drape);
  [[nodiscard]] int strip_of(double warp_m) const;

  double tolerance_;
  std::vector<Piece> pieces_;
  std::vector<std::vector<std::size_t>> strips_;  ///< triangle indices by strip along the warp
  double low_m_ = 1e9, high_m_ = -1e9;
};

}  // namespace drape
