// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "core/scene_values.hpp"
#include "simulate/ensemble/branches.hpp"

namespace drape::simulate {

/// Smallest number of members for a 95 % band.
inline constexpr std::size_t kLeastMembers = 20;

/// Positions of the marks over all starts at rest, in the world; empty below kLeastMembers.
[[nodiscard]] std::vector<BandMark> band_of(const Ensemble& ensemble, const LocalScene& local);

/// Adds a multiple of the weight to gravity in two steps and removes it in two, with the cloth at
/// rest after each. `level` ends with the gravity of its scene.
RestReport push(DrapeLevel& level, ClothMoment& moment, const Eigen::Vector3d& per_weight);

/// Intervals around the rest of the scene's own start, in the world. A rest on another branch, or a
/// failed one, is not counted and states the reason.
struct OwnBands {
  /// Pushed from six sides by half the force that would slide a sheet over a flat table (friction
  /// times its weight), then released: the cloth as a whole stays, while friction is tested
  /// locally. Absent if nothing touches the cloth. `ends`: the same start with the scene's
  /// friction_ends(), if within the distance of one branch.
  std::optional<FrictionBand> friction;
  /// With other loading histories: without internal friction; pushed up and down by half the
  /// weight, without contact also sideways, and released; draped once more; without its history. A
  /// rest more than twice as far as the one without internal friction, which is near the middle of
  /// the interval, or with another number of folds is on another branch. Absent without friction.
  std::optional<MemoryBand> memory;
};

/// Computes the bands on the coarsest mesh; none if the scene's own start did not come to rest.
/// `without` holds the laws of the same fabric without internal friction.
[[nodiscard]] OwnBands bands_of_own(const Ensemble& ensemble, const EnsembleCase& own,
                                    const FittedLaws& without, const EnsembleOptions& how);

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
