// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"
#include "simulate/equilibrium/run.hpp"

namespace drape::simulate {

/// How the interval that internal friction leaves is sought.
struct MemoryPushes {
  /// Of the weight: grows and shrinks by so much. Where nothing touches, sideways as well.
  double part = 0.5;
  int steps = 2;  ///< in which a push grows, and in which it goes again
};

/// A rest of the same sheet under the same load, after another past.
struct MemoryEnd {
  std::string what;                ///< that past
  std::string ending = "at rest";  ///< or why it counts for nothing
  Field position;
  ClothMemory memory;
  StaticReport report;
  bool remembers = true;  ///< false: without internal friction
  /// At its largest, of a push that went again.
  std::optional<Eigen::Vector3d> push_per_weight = std::nullopt;
  [[nodiscard]] bool counts() const { return ending == "at rest"; }
};

/// Where a cloth with internal friction may rest: where the scene's start brought it, and where
/// other pasts leave it. The interval is at least as wide.
struct MemoryBand {
  Field rest;
  std::vector<MemoryEnd> ends;

  /// Of the vertical interval, summed over the particles: 0 lowest, 1 highest; nothing where no
  /// other end counts.
  [[nodiscard]] std::optional<double> place_of_rest() const;
  /// Ends that lie farther than this (mean over the particles) are on another branch: twice as far
  /// as the rest without internal friction, which lies about the middle of the interval, and
  /// `least_m` at least.
  [[nodiscard]] double reach_m(double least_m) const;
};

/// From the rest to which `solver` has brought the scene's drape: without internal friction; after
/// pushes that grew and went again; draped once more, and, where the scene has a history, as if it
/// had none. The solver is left as it was. `the_case.laws.friction` is there; `without` are the
/// laws of the same fabric without it.
[[nodiscard]] MemoryBand ends_of_memory(const StaticCase& the_case, const ClothLaws& without,
                                        const GridSpec& grid, StaticSolver& solver,
                                        const StaticOptions& options, const StaticReport& found,
                                        const MemoryPushes& how = {});

/// Adds `internal_friction_band` to branches.json.
void add_memory_band(const MemoryBand& band, const GridSpec& grid, const Print& print, Json& json);

}  // namespace drape::simulate
