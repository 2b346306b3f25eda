// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "compare/hems/hem_files.hpp"

namespace drape::compare {

/// Reads one hem per row from a table of radii or a hems.csv, which keeps verdicts, geometry, areas
/// and U. Throws Error(bad_input) naming file, line and column, also for an unknown column.
[[nodiscard]] std::vector<HemRecord> read_hems_csv(const std::filesystem::path& file,
                                                   const HemReadOptions& options);

}  // namespace drape::compare
