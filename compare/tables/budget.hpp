// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/tables/error_split.hpp"
#include "compare/tables/tables.hpp"

namespace drape::compare {

/// What the fabric file says of its own values.
struct FabricFacts {
  std::vector<std::string> stand_ins;
};

/// Total uncertainty of the headline's mean distance (GUM, JCGM 100): the standard uncertainties of
/// what it rests on, taken to the distance by sensitivities and added as squares. What has no
/// sensitivity yet is named as missing, never taken as zero in silence.
[[nodiscard]] Budget budget_of(const DrapeInput& input, const Report& report,
                               const std::optional<ErrorSplitFile>& split,
                               const FabricFacts& fabric);

/// Inside, outside or undecided from the mean distance, the budget and the measurement's verdict.
[[nodiscard]] MatchVerdict match_of(const Report& report);

[[nodiscard]] std::string name_of(Match match);
/// One row per contribution, the largest first, and the total.
[[nodiscard]] Table budget_table(const Budget& budget);
/// "U = 0.52 mm (k = 2), most of it from the grid, friction and the place of object 1".
[[nodiscard]] std::string budget_sentence(const Budget& budget);
/// "5.10 mm: 0.30 without a turn of 2.4 degrees and a shift of 3.2 mm, 0.5 of shape".
[[nodiscard]] std::string distance_sentence(const RealVirtual& row);

}  // namespace drape::compare
