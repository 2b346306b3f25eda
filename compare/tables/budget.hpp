// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/metrics/friction_band.hpp"
#include "compare/metrics/memory_band.hpp"
#include "compare/tables/error_split.hpp"
#include "compare/tables/grid_error.hpp"
#include "compare/tables/propagation.hpp"
#include "compare/tables/tables.hpp"

namespace drape::compare {

/// What the mean distance of the headline rests on.
struct BudgetInputs {
  Eigen::MatrixX3d differences_m;  ///< virtual - real of each mark
  double marks_m = 0;              ///< standard uncertainty of the mean, each mark by itself
  std::vector<InputEffect> effects;
  std::vector<std::string> missing;  ///< never taken as zero in silence
};
/// `report` has a headline.
[[nodiscard]] BudgetInputs budget_inputs_of(const DrapeInput& input, const Report& report,
                                            const std::optional<ErrorSplitFile>& split);

/// What the list behind DrapeInput::speaking_branch() says of friction; nothing without one.
[[nodiscard]] std::optional<FrictionBand> friction_band_of(const DrapeInput& input);

/// The same of internal friction.
[[nodiscard]] std::optional<MemoryBand> memory_band_of(const DrapeInput& input);

/// Total uncertainty of the headline's mean distance by propagation of distributions (JCGM 101)
/// over all inputs together, each mark followed in space.
[[nodiscard]] Budget budget_of(const BudgetInputs& inputs, int draws = 10000);

/// One row per contribution, the largest first, and the total.
[[nodiscard]] Table budget_table(const Budget& budget);
/// "U = 0.52 mm (95 %), most of it from the grid, friction and the place of object 1".
[[nodiscard]] std::string budget_sentence(const Budget& budget);
/// "5.10 mm: 0.30 without a turn of 2.4 degrees and a shift of 3.2 mm, 0.5 of shape".
[[nodiscard]] std::string distance_sentence(const RealVirtual& row);

}  // namespace drape::compare
