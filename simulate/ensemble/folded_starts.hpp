// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "simulate/drape/drape.hpp"

namespace drape::simulate {

/// Starts of a cloth on two pins that is folded along the line through them, as a cloth over a
/// line: the part on one side of it, on the other or on both hangs down, straight or with half a
/// wave between the pins. Such a hang has many folded rests that a flat start hardly comes to. None
/// where the pins give no line that parts the cloth.
[[nodiscard]] std::vector<DrapeStart> folded_starts(const DrapeCase& drape);

}  // namespace drape::simulate
