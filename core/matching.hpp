// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cctype>
#include <regex>
#include <string>
#include <utility>

namespace drape {

/// Longest text that is matched, in bytes: std::regex calls itself for each character of a
/// repetition, and overflows the stack above some 40,000 of them.
constexpr std::size_t longest_matched = 4096;

/// std::regex_match() with the same arguments; false for a text that is too long.
template <class... Rest>
[[nodiscard]] bool has_form(const std::string& text, Rest&&... rest) {
  return text.size() <= longest_matched && std::regex_match(text, std::forward<Rest>(rest)...);
}

/// The text with ASCII letters in lower case.
[[nodiscard]] inline std::string in_small_letters(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace drape
