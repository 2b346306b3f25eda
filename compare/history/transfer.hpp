// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace drape::compare {

/// Rows of one table with one key each, and blobs.
struct MergeCounts {
  long long added = 0;
  long long present = 0;  ///< equal in every value that both have
  /// Rows that stood in the target before and of which a source has values that it has not: rows
  /// are never changed.
  std::set<std::string> known_better;
};

/// Imports what `target` lacks from other stores, in one transaction with one manifest. Every row
/// of each source is hashed first. Merging again adds nothing, and the order in which stores are
/// named does not matter: they are taken in the order of their last manifests' hashes. Numbers of
/// runs and comparisons are the target's own. Throws Error(bad_input) when a row of a source was
/// altered, or when two stores contradict each other; the target is then as it was. A value that
/// one store has and the other lacks is no contradiction: what is new in the target gets it.
[[nodiscard]] MergeCounts merge_stores(const std::filesystem::path& target,
                                       const std::vector<std::filesystem::path>& sources);

/// Content carried from a damaged store into another one.
struct Rescue {
  long long kept = 0;             ///< rows of one table with one key each, and blobs
  std::vector<std::string> lost;  ///< those that the damaged store no longer holds as written
};

/// Imports into the store `fresh`, which is made where it is not there, all rows and blobs of a
/// damaged store that still have the hash that its manifests list; nothing else is believed. The
/// damaged store is only read. Again adds nothing. Throws Error(bad_input) when nothing can be
/// read.
[[nodiscard]] Rescue rescue_store(const std::filesystem::path& damaged,
                                  const std::filesystem::path& fresh);

}  // namespace drape::compare
