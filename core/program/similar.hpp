// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace drape {

/// The candidate with the smallest edit distance to `word` (Damerau 1964: insert, delete, replace,
/// swap neighbours); empty if that exceeds a third of its letters.
[[nodiscard]] std::string most_similar(const std::string& word,
                                       const std::vector<std::string>& candidates);

/// Suggestion ": did you mean `x`?"; empty if nothing is similar.
[[nodiscard]] std::string did_you_mean(const std::string& word,
                                       const std::vector<std::string>& candidates);

}  // namespace drape
