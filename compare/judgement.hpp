// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/compare.hpp"

namespace drape::compare {

/// Throws Error(bad_input) where a measured sheet and a mesh or simulation are of two drapes:
/// neither scene nor frame set is the same. A mesh has the set of the simulations of its scene.
void require_one_drape(const DrapeInput& input);

/// Fills no_go with every reason why the measurement is no ground for its distances (the first
/// cause first: sheets that are NO-GO, marks, simulations), and warnings.
void judge(const DrapeInput& input, const Options& options, Report& report);

/// The same of simulations without a real cloth: one that is NO-GO or not at rest is no ground.
void judge_group(const Options& options, VirtualGroup& group, std::vector<std::string>& warnings);

}  // namespace drape::compare
