// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace drape::compare {

/// Content carried from a damaged store into a new one.
struct Rescue {
  long long kept = 0;             ///< units of the ledger: a row with what hangs on it
  std::vector<std::string> lost;  ///< units that the damaged store no longer holds as written
  /// Files behind its numbers that are gone or changed since they were sealed, or why its seal
  /// cannot say.
  std::vector<std::string> lost_files;
};

/// Makes the store `fresh` of every unit whose rows still have the hash that the ledger of the
/// damaged store keeps of them; nothing else is believed. Its copies of sheets
/// come along, and the list of its seal where that is whole. The damaged store is only read. Throws
/// Error(bad_input) when `fresh` is there already or the ledger cannot be found at all.
[[nodiscard]] Rescue rescue_store(const std::filesystem::path& damaged,
                                  const std::filesystem::path& fresh);

}  // namespace drape::compare
