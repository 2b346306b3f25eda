// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/sheet.hpp"

namespace drape::triangulate {

/// Marks that cannot be where they were found, with the reason. Along warp and weft a cloth hardly
/// stretches, and a chord is never longer than its arc: two marks one or two pitches apart on the
/// print can be nearer in space, never farther (White, Crane, Forsyth 2007). A mark that breaks
/// this with two or more others goes first, the worst before the less bad.
[[nodiscard]] std::map<MarkId, std::string> too_far_from_neighbours(
    const std::vector<SheetMark>& marks, double pitch_m, double max_stretch);

/// Pairs that are too far apart though neither mark is to blame more than the other.
[[nodiscard]] std::vector<std::string> suspicious_pairs(const std::vector<SheetMark>& marks,
                                                        double pitch_m, double max_stretch);

}  // namespace drape::triangulate
