// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "compare/compare.hpp"
#include "compare/tables/tables.hpp"

namespace drape::compare {

/// Fills Report::repeats and among_repeats: the layings of the drape that repeat each other, their
/// distances, and the position of the headline among them.
void judge_repeats(const DrapeInput& input, const Options& options, Report& report);

/// Compares a value, which open contributions may change by `open_m`, with a limit (ISO 14253-1).
[[nodiscard]] Match decide(double value_m, double open_m, double limit_m);

/// Verdict on the headline. The limit is the scatter of at least kLeastRepeats real drapes, for
/// their mean distance, else the tolerance, for the mean distance from the drape's own laying. Open
/// contributions: 95 % range of the inputs plus the simulation's own error. Also undecided if the
/// budget lacks a part, or if the value is outside the limit but another branch's within it.
[[nodiscard]] MatchVerdict match_of(const DrapeInput& input, const Options& options,
                                    const Report& report);

[[nodiscard]] std::string name_of(Match match);
/// One row per criterion of the match.
[[nodiscard]] Table basis_table(const Report& report);
/// One row per laying of the drape; empty if it was laid once.
[[nodiscard]] Table repeats_table(const Report& report);

}  // namespace drape::compare
