// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace drape {

/// The candidate with the smallest edit distance to `word` (Damerau 1964: insert, delete, replace,
/// swap neighbours); empty if that exceeds a third of its letters.
[[nodiscard]] std::string most_similar(const std::string& word,
                                       const std::vector<std::string>& candidates);

/// Suggestion ": did you mean `x`?"; empty if nothing is similar.
[[nodiscard]] std::string did_you_mean(const std::string& word,
                                       const std::vector<std::string>& candidates);

/// One word of a command line as typed in a shell, quoted if necessary.
[[nodiscard]] inline std::string shell_word(std::string_view word) {
  constexpr std::string_view plain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=,:+@%";
  if (!word.empty() && word.find_first_not_of(plain) == std::string_view::npos)
    return std::string(word);
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace drape
