// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "compare/compare.hpp"
#include "compare/tables/tables.hpp"

namespace drape::compare {

/// Which layings of the drape are repeats of each other, how far they lie apart, and where the
/// headline is among them: Report::repeats and among_repeats.
void judge_repeats(const DrapeInput& input, const Options& options, Report& report);

/// Inside, outside or undecided, and what that rests on. With kLeastRepeats real drapes or more:
/// inside when the headline could be one more of them at the stated significance; outside else,
/// but undecided within the total uncertainty U, for then fabric and scene values may be why. With
/// fewer: inside within U; above it outside, but undecided where the budget lacks a part, or where
/// the real drape is on a branch of the ensemble and in its band, for then the start may be why.
[[nodiscard]] MatchVerdict match_of(const DrapeInput& input, const Report& report);

[[nodiscard]] std::string name_of(Match match);
/// One row per thing the match is judged against.
[[nodiscard]] Table basis_table(const Report& report);
/// One row per laying of the drape; none where it was laid once.
[[nodiscard]] Table repeats_table(const Report& report);

}  // namespace drape::compare
