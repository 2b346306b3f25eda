// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace drape::compare {

/// Counts of keys (with the rows of one table that have the key) and blobs.
struct MergeCounts {
  long long added = 0;
  long long present = 0;  ///< equal in every value that both stores have
  /// Rows of the target for which a source has values that the target lacks: rows are never
  /// changed.
  std::set<std::string> known_better;
};

/// Imports everything missing in `target` from other stores, in one transaction with one manifest.
/// Every row of each source is hashed first. Merging again adds nothing, and the order of the
/// sources does not matter: they are processed in the order of the hashes of their last manifests.
/// Numbers of runs and comparisons are the target's own. Throws Error(bad_input) if a row of a
/// source was altered, or if two stores contradict each other, and leaves the target unchanged. A
/// value that only one store has is not a contradiction: new rows of the target get it.
[[nodiscard]] MergeCounts merge_stores(const std::filesystem::path& target,
                                       const std::vector<std::filesystem::path>& sources);

/// Content copied from a damaged store into another one.
struct Rescue {
  long long kept = 0;             ///< keys (with their rows) and blobs
  std::vector<std::string> lost;  ///< those that the damaged store no longer has as written
};

/// Imports all rows and blobs of a damaged store that still have the hash listed in its
/// manifests into the store `fresh`, which is created if absent; nothing else is trusted. The
/// damaged store is only read. Repeating it adds nothing. Throws Error(bad_input) if nothing can
/// be read.
[[nodiscard]] Rescue rescue_store(const std::filesystem::path& damaged,
                                  const std::filesystem::path& fresh);

}  // namespace drape::compare
