// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/compare.hpp"

namespace drape::compare {

/// Fills no_go with every reason why the measurement is no ground for its distances (the first
/// cause first: sheets that are NO-GO, marks, simulations), and warnings.
void judge(const DrapeInput& input, const Options& options, Report& report);

}  // namespace drape::compare
