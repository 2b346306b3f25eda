// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/sheet.hpp"

namespace drape::triangulate {

/// Finds marks at impossible positions, with the reason. Cloth hardly stretches along warp and
/// weft, and a chord is never longer than its arc: two marks one or two pitches apart on the print
/// can be closer in space, but never farther apart (White, Crane, Forsyth 2007). Marks that violate
/// this with at least two others are removed one by one, the worst first.
[[nodiscard]] std::map<MarkId, std::string> too_far_from_neighbours(
    const std::vector<SheetMark>& marks, double pitch_m, double max_stretch);

/// Pairs that are too far apart without either mark being more to blame.
[[nodiscard]] std::vector<std::string> suspicious_pairs(const std::vector<SheetMark>& marks,
                                                        double pitch_m, double max_stretch);

}  // namespace drape::triangulate
