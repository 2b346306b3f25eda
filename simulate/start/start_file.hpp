// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/sheet.hpp"

namespace drape::simulate {

/// Reads the file given by --start-from: a measured sheet, or the description of another
/// simulator's mesh ("drapebench/mesh/1", *.toml; CONVENTIONS.md). A mesh is sampled at every mark
/// of the print, linear on its triangles, or on two triangles per cell of its [grid]. Throws
/// Error(bad_input) naming file and field, also if the mesh does not cover a mark of the print.
[[nodiscard]] Sheet read_start(const std::filesystem::path& file, const Print& print);

/// Throws Error(bad_input) if a sheet has another patch than the print or, if measured, other
/// marks: its points would be taken for other points of the cloth.
void require_of_print(const Sheet& sheet, const std::filesystem::path& file, const Print& print);

/// The files that make up a start, for the run record.
[[nodiscard]] std::vector<std::filesystem::path> start_files(const std::filesystem::path& file);

/// SHA-256 of the start in lower-case hexadecimal.
[[nodiscard]] std::string start_sha256(const std::filesystem::path& file);

}  // namespace drape::simulate
