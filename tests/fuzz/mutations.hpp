// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace drape::test {

/// A damaged copy of a text file, determined by text and seed: a few bytes flipped, inserted or
/// removed, lines duplicated, dropped or swapped, numbers replaced by extreme ones, values by
/// others of another type, the end cut off, brackets nested 100,000 deep, a word of 256 KB, or
/// another encoding.
[[nodiscard]] std::string spoiled(const std::string& text, std::uint32_t seed);

/// A text with one fault, and whether a reader can tell it from a good file.
struct Fault {
  std::string text, kind;
  std::string line;  ///< the line before its fault
  bool can_tell = true;
};

/// Spoils one value of a text (dropped, another type, out of range, not finite, given twice), its
/// structure, encoding, end, depth or size, in turn by the seed.
[[nodiscard]] Fault one_fault(const std::string& text, std::uint32_t seed);

}  // namespace drape::test
