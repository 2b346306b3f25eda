// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/scene_values.hpp"
#include "simulate/ensemble/branches.hpp"

namespace drape::simulate {

/// Standard uncertainties of all stated values except friction, which bands_of_own() varies:
/// positions, sizes, level, a flat start placed with a steel ruler, fabric values (per cent). Names
/// as in sensitivity.json and erring().
[[nodiscard]] ValueErrors uncertainties_of(const Scene& scene, const Fabric& fabric,
                                           const Print& print);

/// The case with these errors in scene and fabric as stated. `measured`: as in ensemble_case().
[[nodiscard]] EnsembleCase erring(const EnsembleCase& own, const std::optional<Sheet>& measured,
                                  const ValueErrors& errors);

/// Drapes the scene's own start eight times on the coarsest mesh with errors in all values of
/// uncertainties_of() at once, each one standard uncertainty up or down by a seeded coin, and
/// compares with the first-order responses of the undisturbed rest on that mesh. A rest farther
/// away than rests of one branch, or no rest, is not counted, with the reason. nullopt if the
/// undisturbed start has no rest or no first-order response.
[[nodiscard]] std::optional<BeyondFirstOrder> beyond_first_order(
    const Ensemble& ensemble, const EnsembleCase& own, const std::optional<Sheet>& measured,
    const EnsembleOptions& how);

}  // namespace drape::simulate
