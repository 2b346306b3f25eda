// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/compare.hpp"

namespace drape::compare {

/// Throws Error(bad_input) if a measured sheet and a mesh or simulation belong to two drapes:
/// neither scene nor frame set agree. A mesh has the set of the simulations of its scene.
void require_one_drape(const DrapeInput& input);

/// Sets no_go to all reasons why the distances cannot be trusted (the first cause first: sheets
/// that are NO-GO, marks, simulations), and adds warnings.
void judge(const DrapeInput& input, const Options& options, Report& report);

/// The same for simulations without a real cloth: reasons are those that are NO-GO or not at rest.
void judge_group(const Options& options, VirtualGroup& group, std::vector<std::string>& warnings);

}  // namespace drape::compare
