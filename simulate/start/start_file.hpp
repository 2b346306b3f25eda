// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/sheet.hpp"

namespace drape::simulate {

/// File that --start-from names: a measured sheet, or the description of another simulator's mesh
/// ("drapebench/mesh/1", *.toml; CONVENTIONS.md). A mesh is taken at every mark of the print,
/// linear on its triangles, or on two triangles per cell of its [grid]. Throws Error(bad_input)
/// naming file and field, also where the mesh does not cover a mark of the print.
[[nodiscard]] Sheet read_start(const std::filesystem::path& file, const Print& print);

/// Throws Error(bad_input) where a sheet is of another patch than the print's or, measured, of
/// other marks: its points would then be taken for other places of the cloth.
void require_of_print(const Sheet& sheet, const std::filesystem::path& file, const Print& print);

/// The files that a start consists of, for the run record.
[[nodiscard]] std::vector<std::filesystem::path> start_files(const std::filesystem::path& file);

/// Lower-case hexadecimal SHA-256 of what was started from.
[[nodiscard]] std::string start_sha256(const std::filesystem::path& file);

}  // namespace drape::simulate
