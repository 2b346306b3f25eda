// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "core/run_report.hpp"

namespace drape::compare {

/// Writes the page `file` (self-contained), report.json with the same stem, and, in a folder named
/// like the stem, the tables as .csv and the marks as .vtp. Removes files of an earlier report that
/// this one does not write, recognised by name. Returns the files written, the page last. Equal
/// records give equal bytes.
std::vector<std::filesystem::path> write_report(const std::filesystem::path& file,
                                                const RunReport& report);

}  // namespace drape::compare
