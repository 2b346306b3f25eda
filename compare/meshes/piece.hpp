// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/drape_input.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {

/// Whether the .json beside a mesh is what `drape simulate piece` writes ("drapebench/piece/1").
[[nodiscard]] bool is_piece(const std::filesystem::path& json);

/// "at rest", or why not.
[[nodiscard]] std::string status_of_piece(const JsonNode& piece);

/// Of a mesh that `drape simulate piece` made: adds the verdict that stands in the .json beside its
/// description ("drapebench/piece/1"), and the scene that its run record names. Any other mesh
/// stays as it is. Throws Error(bad_input) where a file is not what the run wrote.
void read_piece_beside(const std::filesystem::path& description, Simulation& simulation);

}  // namespace drape::compare
