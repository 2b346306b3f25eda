// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace drape::compare {

/// Units of the ledger (a sheet with its gaps, a comparison with its marks, a run).
struct MergeCounts {
  long long added = 0;
  long long present = 0;  ///< equal in every value that both have
  /// Units that stood in the target before and of which a source has values that it has not: rows
  /// are never changed.
  std::set<std::string> known_better;
};

/// Copies what `target` lacks from other stores into it, in one transaction, with the copies of
/// their sheets, and seals it. The ledger of each source is recomputed first. Merging again adds
/// nothing, and the order in which stores are named does not matter: they are taken in the order of
/// the ends of their ledgers. Numbers of runs and comparisons are the target's own. Throws
/// Error(bad_input) when a row of a source was changed, or when two stores contradict each other;
/// the target is then as it was. A value that one store has and the other lacks is no
/// contradiction: what is new in the target gets it.
[[nodiscard]] MergeCounts merge_stores(const std::filesystem::path& target,
                                       const std::vector<std::filesystem::path>& sources);

}  // namespace drape::compare
