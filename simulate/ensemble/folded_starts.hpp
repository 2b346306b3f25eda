// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "simulate/drape/drape.hpp"

namespace drape::simulate {

/// Starts of a cloth on two pins that is folded along the line through them, as over a washing
/// line: the part on one side, on the other, or both hang down, straight or with half a wave
/// between the pins. Such a drape has many folded rests that a flat start rarely reaches. Empty if
/// the pins define no line that divides the cloth.
[[nodiscard]] std::vector<DrapeStart> folded_starts(const DrapeCase& drape);

}  // namespace drape::simulate
