// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "core/scene.hpp"
#include "simulate/ensemble/branches.hpp"

namespace drape::simulate {

/// Smallest number of members for a 95 % band.
inline constexpr std::size_t kLeastMembers = 20;

/// Positions of the marks over all starts at rest, in the world; empty below kLeastMembers.
[[nodiscard]] std::vector<BandMark> band_of(const Ensemble& ensemble, const LocalScene& local);

/// Adds a multiple of the weight to gravity in two steps and removes it in two, with the cloth at
/// rest after each. `level` ends with the gravity of its scene.
RestReport push(DrapeLevel& level, ClothMoment& moment, const Eigen::Vector3d& per_weight);

/// Intervals around the equilibrium of the scene's own start, in the world. An equilibrium on
/// another branch, or a failed one, is not counted and states the reason.
struct OwnBands {
  /// Interval due to friction. The cloth is pushed from six directions by half the force that
  /// slides a sheet over a flat table (friction times its weight), then released: as a whole it
  /// stays, while friction is tested locally. Absent if nothing touches the cloth. `ends`: the same
  /// start with the scene's friction_ends(), if within the distance of one branch.
  std::optional<FrictionBand> friction;
  /// Interval due to the loading history: without internal friction; pushed up and down by half the
  /// weight, without contact also sideways, and released; draped once more; without its history.
  /// Friction-free equilibrium lies near the middle of the interval. One more than twice as far
  /// away, or with another number of folds, is on another branch. Absent without internal friction.
  std::optional<MemoryBand> memory;
};

/// Computes the bands on the coarsest mesh; none if the scene's own start did not reach
/// equilibrium. `without` holds the laws of the same fabric without internal friction.
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
/// uncertainties_of() at once, each one standard uncertainty up or down at random (seeded), and
/// compares with the first-order responses of the unperturbed equilibrium on that mesh. A run that
/// fails or ends farther from its first-order response than one branch reaches is not counted; the
/// reason is stated. nullopt if the unperturbed start has no equilibrium or no first-order
/// response.
[[nodiscard]] std::optional<BeyondFirstOrder> beyond_first_order(
    const Ensemble& ensemble, const EnsembleCase& own, const std::optional<Sheet>& measured,
    const EnsembleOptions& how);

}  // namespace drape::simulate
