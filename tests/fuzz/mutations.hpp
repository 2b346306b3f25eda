// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace drape::test {

/// A spoiled copy of a text file, a function of text and seed alone: a few bytes flipped, inserted
/// or removed, lines doubled, dropped or swapped, numbers replaced by extreme ones, values by such
/// of another type, or the end cut.
[[nodiscard]] std::string spoiled(const std::string& text, std::uint32_t seed);

}  // namespace drape::test
