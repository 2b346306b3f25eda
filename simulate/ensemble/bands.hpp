// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "simulate/ensemble/branches.hpp"

namespace drape::simulate {

/// Fewer members say nothing of 95 %.
inline constexpr std::size_t kLeastMembers = 20;

/// Places of the marks over all starts at rest, in the world; empty with fewer than kLeastMembers.
[[nodiscard]] std::vector<BandMark> band_of(const Ensemble& ensemble, const LocalScene& local);

/// Adds so many weights to gravity in two steps and takes them away in two, the cloth resting at
/// each. `level` ends with the gravity that its scene has.
RestReport push(DrapeLevel& level, ClothMoment& moment, const Eigen::Vector3d& per_weight);

/// Intervals about the rest of the scene's own start, in the world. A rest that lies farther away
/// than rests of one branch, or is none, counts for nothing and says why.
struct OwnBands {
  /// Pushed by half of what slides a sheet over a flat table (friction times its weight) from six
  /// sides and let go: what lies as a whole stays, and what friction holds locally is tried. Absent
  /// where nothing touches the cloth. Its ends: the same start with the scene's friction_ends(), as
  /// far as rests of one branch lie apart.
  std::optional<FrictionBand> friction;
  /// After other pasts: without internal friction; pushed up and down by half of the weight, where
  /// nothing touches also sideways, and let go; draped once more; without its history. Farther than
  /// twice the rest without internal friction, which lies about the middle of the interval, or with
  /// other folds of the hem is another branch. Absent without internal friction.
  std::optional<MemoryBand> memory;
};

/// Bands on the coarsest mesh; none where the scene's own start did not come to rest. `without`:
/// laws of the same fabric without internal friction.
[[nodiscard]] OwnBands bands_of_own(const Ensemble& ensemble, const EnsembleCase& own,
                                    const FittedLaws& without, const EnsembleOptions& how);

}  // namespace drape::simulate
