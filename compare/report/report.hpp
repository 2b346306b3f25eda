// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "core/run_report.hpp"

namespace drape::compare {

/// Writes the page `file` (one file, nothing is fetched), report.json under the same stem, and in a
/// folder named like the stem the tables as .csv and the marks as .vtp. What an earlier report
/// wrote there and this one does not, by its name, is removed. Returns the files written, the page
/// last. The same record gives the same bytes.
std::vector<std::filesystem::path> write_report(const std::filesystem::path& file,
                                                const RunReport& report);

}  // namespace drape::compare
