// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/metrics/ensemble.hpp"
#include "compare/report/figures.hpp"

namespace drape::compare {

/// What the list behind a set of branches says of the ensemble as a whole.
[[nodiscard]] std::optional<Ensemble> ensemble_of(const DrapeInput& input, const BranchSet& set);

/// From above and from the side: each mark's band as a disc at its true size, the real mark in it
/// or outside. Nothing without bands.
[[nodiscard]] std::optional<Figure> band_figure(const std::string& drape, const DrapeInput& input,
                                                const BranchSet& set);

}  // namespace drape::compare
