// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>

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

}  // namespace drape
