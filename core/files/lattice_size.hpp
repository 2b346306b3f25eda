// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace drape {

/// Largest number of marks in a lattice. A dot needs 8 x 8 px to be measured and an
/// image holds at most 2^26 px, so no camera can see more; larger counts in a file are
/// invalid.
inline constexpr std::int64_t kMostMarks = std::int64_t{1} << 20;

/// True for 1 to kMostMarks marks.
[[nodiscard]] constexpr bool is_lattice_size(int rows, int cols) {
  return rows > 0 && cols > 0 && std::int64_t{rows} * cols <= kMostMarks;
}

}  // namespace drape
