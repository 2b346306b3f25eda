// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "simulate/cloth/cloth.hpp"

namespace drape::simulate {

/// A start that differs from `rests`, of which there is at least one; `index` is that of a seeded
/// sequence. In turns: a round part of a rest moves across its own plane or is mirrored in it; or
/// what lies beyond a line across the sheet is taken from another rest, with a smooth border (cut
/// and splice, Deaven and Ho 1995): folds of one part hardly depend on those of another, so that
/// the lower ones of two rests come together.
[[nodiscard]] Field kicked(const GridSpec& grid, std::uint64_t index,
                           const std::vector<const Field*>& rests);

}  // namespace drape::simulate
