// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "compare/compare.hpp"
#include "compare/drape_input.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {

/// Reads a drape that another program made, from a small file that people write beside its mesh
/// ("drapebench/mesh/1", *.toml):
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
///
/// A mesh with texture coordinates is taken at the measured marks and, between them, at least every
/// 2 mm of cloth, linear on its triangles; without them its vertices are the points. The mesh's
/// world must be the bench's, and its neighbours must lie about as far apart as on the cloth: else
/// a unit is wrong. Throws Error(bad_input) naming file and field.
[[nodiscard]] Simulation read_other_mesh(const std::filesystem::path& file, const Sheet& measured);

/// Reads a mesh that says `correspondence = "none"` instead of [grid] or [uv]: only its surface can
/// be compared. Nothing when the description does not say so. Throws Error(bad_input).
[[nodiscard]] std::optional<OtherSurface> read_other_surface(const std::filesystem::path& file);

/// The file as a sheet's identity in the store, without reading the mesh: the hash of both files.
struct OtherMeshId {
  std::string sha256;
  std::filesystem::path mesh;
  std::string mesh_sha256;
};
/// Nothing when the file is not a "drapebench/mesh" or its mesh is not there.
[[nodiscard]] std::optional<OtherMeshId> other_mesh_id(const std::filesystem::path& file);

/// Whether the .json beside a mesh is what `drape simulate piece` writes ("drapebench/piece/1").
[[nodiscard]] bool is_piece(const std::filesystem::path& json);

/// "at rest", or why not.
[[nodiscard]] std::string status_of_piece(const JsonNode& piece);

/// Of a mesh that `drape simulate piece` made: adds the verdict that stands in the .json beside its
/// description ("drapebench/piece/1"), and the scene that its run record names. Any other mesh
/// stays as it is. Throws Error(bad_input) where a file is not what the run wrote.
void read_piece_beside(const std::filesystem::path& description, Simulation& simulation);

}  // namespace drape::compare
