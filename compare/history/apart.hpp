// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace drape::compare {

/// Counts of sheets of a study.
struct ApartCounts {
  int added = 0;
  int present = 0;             ///< already in the store
  std::size_t unfinished = 0;  ///< without a run record: left out
};

/// Adds simulated sheets individually, without comparing them. Some hundreds at a time are held in
/// memory and written in one transaction. Throws Error(usage) for a measured sheet, and like
/// read_session().
[[nodiscard]] ApartCounts import_simulations(const std::filesystem::path& store,
                                             std::vector<std::filesystem::path> sheets);

}  // namespace drape::compare
