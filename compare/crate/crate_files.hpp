// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "compare/records/provenance.hpp"
#include "compare/store/store.hpp"

namespace drape::compare {

/// What is found of a file, before its name.
inline const std::string kGone = "gone: ", kNotAsRecorded = "not what was recorded: ",
                         kNotTraced = "no record of how it was made: ";

/// Every file behind the sheets of one run, or of the whole store, with the contents (SHA-256) that
/// records, seal and store state of it: one that has another content is not what the numbers rest
/// on. Sheets and scenes that no file has any more are added to `findings`. Throws
/// Error(usage) for a run that the store does not have.
[[nodiscard]] std::map<std::filesystem::path, std::set<std::string>> crate_files(
    const StoreReader& store, std::optional<int> run, RecordBook& book,
    std::vector<std::string>& findings);

}  // namespace drape::compare
