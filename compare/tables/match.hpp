// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "compare/compare.hpp"
#include "compare/tables/tables.hpp"

namespace drape::compare {

/// Layings of the drape that repeat each other, their distances, and the place of the
/// headline is among them: Report::repeats and among_repeats.
void judge_repeats(const DrapeInput& input, const Options& options, Report& report);

/// Where a value is beside a limit that everything open may move it by `open_m` from (ISO 14253-1).
[[nodiscard]] Match decide(double value_m, double open_m, double limit_m);

/// Decision of the headline. The limit is the scatter of kLeastRepeats real drapes or more, for
/// their mean distance, else the tolerance, for the mean distance of the drape's own; open are the
/// inputs' 95 % range and, added, the simulation's own error. Undecided too where the budget lacks
/// a part, and outside the limit where another start's branch is within it.
[[nodiscard]] MatchVerdict match_of(const DrapeInput& input, const Options& options,
                                    const Report& report);

[[nodiscard]] std::string name_of(Match match);
/// One row per thing the match is judged against.
[[nodiscard]] Table basis_table(const Report& report);
/// One row per laying of the drape; none where it was laid once.
[[nodiscard]] Table repeats_table(const Report& report);

}  // namespace drape::compare
