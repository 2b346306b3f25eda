// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace drape::compare {

/// Sheets of a study.
struct ApartCounts {
  int added = 0;
  int present = 0;             ///< in the store already
  std::size_t unfinished = 0;  ///< no run record beside them: left out
};

/// Adds simulated sheets, each by itself: nothing is compared. Some hundreds are in memory at a
/// time, and are one transaction. Throws Error(usage)
/// for a measured sheet, and like read_session().
[[nodiscard]] ApartCounts import_simulations(const std::filesystem::path& store,
                                             std::vector<std::filesystem::path> sheets);

}  // namespace drape::compare
