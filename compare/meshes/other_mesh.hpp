// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "compare/compare.hpp"
#include "compare/drape_input.hpp"

namespace drape::compare {

/// Reads a drape that another program made (core/drape_mesh.hpp, "drapebench/mesh/1", *.toml).
/// A mesh with texture coordinates is taken at the measured marks and, between them, at least every
/// 2 mm of cloth, linear on its triangles; without them its vertices are the points. The mesh's
/// world must be the bench's, and its neighbours must lie about as far apart as on the cloth: else
/// a unit is wrong. Throws Error(bad_input) naming file and field.
/// `mesh`: file that holds the mesh in place of the one that is named.
[[nodiscard]] Simulation read_other_mesh(const std::filesystem::path& file, const Sheet& measured,
                                         const std::filesystem::path& mesh = {});

/// Reads a mesh that says `correspondence = "none"` instead of [grid] or [uv]: only its surface can
/// be compared. Nothing when the description does not say so. Throws Error(bad_input).
[[nodiscard]] std::optional<OtherSurface> read_other_surface(
    const std::filesystem::path& file, const std::filesystem::path& mesh = {});

/// Content whose hash is the identity of a mesh in the store: the hashes of its description and of
/// the mesh.
[[nodiscard]] std::string other_mesh_content(const std::string& description_sha256,
                                             const std::string& mesh_sha256);

/// The hash of the description in such content; nothing where it is other content.
[[nodiscard]] std::optional<std::string> description_in(const std::string& content);

/// The file as a sheet's identity in the store, without reading the mesh: the hash of both files.
struct OtherMeshId {
  std::string sha256;
  std::filesystem::path mesh;
  std::string mesh_sha256;
};
/// Empty when the file is not a "drapebench/mesh" or its mesh is not there.
[[nodiscard]] std::optional<OtherMeshId> other_mesh_id(const std::filesystem::path& file);

}  // namespace drape::compare
