// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/scene_values.hpp"
#include "simulate/ensemble/branches.hpp"

namespace drape::simulate {

/// Standard uncertainties of all that is stated but friction, which bands_of_own() drapes again:
/// places, sizes, level, a flat start laid by a steel rule, fabric values (per cent). Names as of
/// sensitivity.json and erring().
[[nodiscard]] ValueErrors uncertainties_of(const Scene& scene, const Fabric& fabric,
                                           const Print& print);

/// The case where scene and fabric are stated with these errors. `measured`: as of ensemble_case().
[[nodiscard]] EnsembleCase erring(const EnsembleCase& own, const std::optional<Sheet>& measured,
                                  const ValueErrors& errors);

/// Drapes the scene's own start eight times on the coarsest mesh with everything that
/// uncertainties_of() names wrong at once, by one standard uncertainty up or down as seeded coins
/// fall, beside the first-order answers of the undisturbed rest on that mesh. A rest
/// farther away than rests of one branch, or none, counts for nothing and says why. Absent where
/// the undisturbed start has no rest or no first-order answer.
[[nodiscard]] std::optional<BeyondFirstOrder> beyond_first_order(
    const Ensemble& ensemble, const EnsembleCase& own, const std::optional<Sheet>& measured,
    const EnsembleOptions& how);

}  // namespace drape::simulate
