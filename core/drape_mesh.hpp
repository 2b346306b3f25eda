// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/files/mesh_file.hpp"

namespace drape {

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

/// Material coordinates (warp, weft) where a grid or texture starts and ends, metres.
struct MaterialRange {
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero(), to_m = Eigen::Vector2d::Zero();

  /// `part` from 0 to 1 along warp and weft.
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& part) const {
    return from_m + part.cwiseProduct(to_m - from_m);
  }
};
struct VertexGrid {
  ClothDirection inner = ClothDirection::weft;  ///< along which the index grows by one
  int inner_count = 0;
  MaterialRange range;
};
struct TextureMap {
  TextureDirection warp = TextureDirection::v;  ///< texture coordinate along the warp
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

  MeshFile mesh;                                 ///< read by read_drape_mesh()
  std::vector<Eigen::Vector3d> points_in_world;  ///< its vertices

  /// Throws Error(bad_input) at that field of the description.
  [[noreturn]] void reject(const char* field, const std::string& what,
                           const std::string& remedy) const;
  /// Vertices of a [grid] outside of the inner direction.
  [[nodiscard]] int outer_count() const;
  /// Material coordinates of the vertex of a [grid] at those steps along both directions.
  [[nodiscard]] Eigen::Vector2d material_m(int inner, int outer) const;
};
template <>
inline constexpr Format format_of<DrapeMesh>{"mesh", Syntax::toml, 1,
                                             "mesh of a drape that another program made"};
void fields(Fields& f, DrapeMesh& drape);

/// The description and its mesh. Throws Error(bad_input) naming file and field.
[[nodiscard]] DrapeMesh read_drape_mesh(const std::filesystem::path& file);

/// A mesh over its material coordinates: linear on its triangles.
class MaterialSurface {
 public:
  /// `tolerance`: a point counts as on a triangle by this much of it.
  MaterialSurface(const DrapeMesh& drape, double tolerance);
  /// World point of the first triangle there; nothing where the mesh has none.
  [[nodiscard]] std::optional<Eigen::Vector3d> at(const Eigen::Vector2d& material_m) const;

 private:
  struct Piece {
    Eigen::Matrix2d to_weights;  ///< material offset from the first corner to two weights
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
  std::vector<std::vector<std::size_t>> strips_;  ///< pieces by their warp
  double low_m_ = 1e9, high_m_ = -1e9;
};

}  // namespace drape
