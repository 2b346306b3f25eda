// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace drape {

/// The candidate that needs fewest typed corrections (Damerau 1964: insert, delete, replace, swap
/// neighbours) to become `word`; empty when even that one needs more than a third of its letters.
[[nodiscard]] std::string most_similar(const std::string& word,
                                       const std::vector<std::string>& candidates);

/// ": did you mean `x`?", or nothing.
[[nodiscard]] std::string did_you_mean(const std::string& word,
                                       const std::vector<std::string>& candidates);

}  // namespace drape
