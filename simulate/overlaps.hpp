// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/objects/surroundings.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// How far the sheet is from the objects, or deep in them: at and between its particles.
void measure_gaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                  SimulateReport& report);

/// What the sheet does that cloth cannot: it is said, and such a sheet is not called at rest.
void judge_overlaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                    const SimulateOptions& options, SimulateReport& report);

/// Warns where the cloth leaves a clamp at a large angle to the clamp's direction: its bend is then
/// within one grid spacing. Folded back it is refused by the checker.
void judge_clamps(const Scene& scene, const GridSpec& grid, const Sheet& sheet,
                  SimulateReport& report);

}  // namespace drape::simulate
