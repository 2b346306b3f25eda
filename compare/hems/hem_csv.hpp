// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "compare/hems/hem_files.hpp"

namespace drape::compare {

/// A row per hem, of a table of radii or of hems.csv, which keeps its verdicts, geometry, areas and
/// U. Throws Error(bad_input) naming file, line and column, for an unknown column too.
[[nodiscard]] std::vector<HemRecord> read_hems_csv(const std::filesystem::path& file,
                                                   const HemReadOptions& options);

}  // namespace drape::compare
