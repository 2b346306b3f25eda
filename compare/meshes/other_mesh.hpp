// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "compare/compare.hpp"
#include "compare/drape_input.hpp"

namespace drape::compare {

/// Reads a drape made by another program (core/drape_mesh.hpp, "drapebench/mesh/1", *.toml). A mesh
/// with texture coordinates is sampled at the measured marks and, between them, at least every 2 mm
/// of cloth, linear on its triangles; otherwise its vertices are the points. The mesh must be in
/// the bench's world, and adjacent points must be about as far apart as on the cloth, since
/// otherwise a unit is wrong. Throws Error(bad_input) that names file and field. `mesh`: file to
/// read instead of the mesh named in the description.
[[nodiscard]] Simulation read_other_mesh(const std::filesystem::path& file, const Sheet& measured,
                                         const std::filesystem::path& mesh = {});

/// Reads a mesh that states `correspondence = "none"` instead of [grid] or [uv]: only its surface
/// can be compared. nullopt if the description does not state it. Throws Error(bad_input).
[[nodiscard]] std::optional<OtherSurface> read_other_surface(
    const std::filesystem::path& file, const std::filesystem::path& mesh = {});

/// Content whose hash identifies a mesh in the store: the hashes of its description and of the
/// mesh.
[[nodiscard]] std::string other_mesh_content(const std::string& description_sha256,
                                             const std::string& mesh_sha256);

/// The hash of the description in such content; nullopt for other content.
[[nodiscard]] std::optional<std::string> description_in(const std::string& content);

/// Identity of the file as a sheet in the store, without reading the mesh: the hash of both files.
struct OtherMeshId {
  std::string sha256;
  std::filesystem::path mesh;
  std::string mesh_sha256;
};
/// nullopt if the file is not a "drapebench/mesh" or its mesh does not exist.
[[nodiscard]] std::optional<OtherMeshId> other_mesh_id(const std::filesystem::path& file);

}  // namespace drape::compare
