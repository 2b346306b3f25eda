// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstdint>

namespace drape {

/// A mark of a patch or a dot of a target. On a patch, row runs along the warp, col along the weft,
/// and (0, 0) is at the corner marked on the print. On a target, row runs along y, col along x.
struct MarkId {
  int row = 0;
  int col = 0;
  auto operator<=>(const MarkId&) const =
      default;  // NOLINT(modernize-use-nullptr): by the compiler
};

[[nodiscard]] constexpr MarkId operator+(MarkId a, MarkId b) {
  return {a.row + b.row, a.col + b.col};
}
[[nodiscard]] constexpr MarkId operator-(MarkId a, MarkId b) {
  return {a.row - b.row, a.col - b.col};
}

/// Largest number of marks in a lattice. A dot needs 8 x 8 px to be measured and an
/// image holds at most 2^26 px, so no camera can see more; larger counts in a file are
/// invalid.
inline constexpr std::int64_t kMostMarks = std::int64_t{1} << 20;

/// True for 1 to kMostMarks marks.
[[nodiscard]] constexpr bool is_lattice_size(int rows, int cols) {
  return rows > 0 && cols > 0 && std::int64_t{rows} * cols <= kMostMarks;
}

}  // namespace drape
