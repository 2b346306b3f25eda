// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "simulate/equilibrium/run.hpp"

namespace drape::simulate {

/// Starts of a sheet on two pins that is folded along the line through them, as a cloth over a
/// line: what lies on one side of it, on the other or on both hangs down, straight or with half a
/// wave between the pins. None where the pins give no line that parts the sheet.
[[nodiscard]] std::vector<StartChange> folded_starts(const StaticCase& the_case);

}  // namespace drape::simulate
