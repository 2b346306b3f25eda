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
/// Empty when the file is not a "drapebench/mesh" or its mesh is not there.
[[nodiscard]] std::optional<OtherMeshId> other_mesh_id(const std::filesystem::path& file);

}  // namespace drape::compare
