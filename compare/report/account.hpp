// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/store/outcome.hpp"

namespace drape::compare {

/// Returns everything found by a call of drape-compare, for a report in `folder`, to which paths
/// are relative. The same session gives the same record, so the run's date is its only time.
[[nodiscard]] RunReport account_of(const Session& session, const Outcome& outcome,
                                   const std::filesystem::path& folder);

/// Text common to warnings that differ only in step, drape and numbers.
[[nodiscard]] std::string kind_of_note(const std::string& text);

}  // namespace drape::compare
