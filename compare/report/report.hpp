// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"

namespace drape::compare {

/// Writes report.html (self-contained XHTML-style HTML without external loads; its one script turns
/// the 3D view, everything else stands without it) and,
/// beside it in a folder named like its stem, the same pictures as .svg and the tables as .csv.
/// What an earlier report wrote there and this one does not, by its name, is removed. Returns the
/// files written, the report last. The same session gives the same bytes; paths in it are relative
/// to the report's folder.
std::vector<std::filesystem::path> write_report(const std::filesystem::path& file,
                                                const Session& session, const Outcome& outcome);

}  // namespace drape::compare
