// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

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

}  // namespace drape::simulate
