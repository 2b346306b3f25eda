// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"
#include "core/rig.hpp"
#include "simulate/equilibrium/run.hpp"
#include "simulate/equilibrium/solver.hpp"

namespace drape::simulate {

/// Options of pushing a rest.
struct PushOptions {
  /// Share of the push that slides a sheet over a flat table, which is friction times its weight.
  /// Half of it: what lies as a whole stays, and what friction holds locally is tried from every
  /// side.
  double part = 0.5;
  int steps = 2;  ///< in which the push grows, and in which it goes again
  /// Residual, in the mean particle's weight, at which all but the last of them end: as
  /// Runge-Kutta's rests.
  double residual = 1e-3;
};

/// Where a sheet rests after a push that grew and went again.
struct FrictionPush {
  Eigen::Vector3d push_per_weight = Eigen::Vector3d::Zero();  ///< at its largest
  std::string ending = "at rest";                             ///< or why it counts for nothing
  Field position;
  ClothMemory memory;  ///< state of internal friction
  StaticReport report;
  [[nodiscard]] bool counts() const { return ending == "at rest"; }
};

/// Friction holds a sheet anywhere in an interval. Rests of it that are found: the one that the
/// scene's start came to, and those that pushes leave behind; the interval is at least as wide.
struct FrictionBand {
  double friction = 0;
  Field rest;  ///< before any push
  std::vector<FrictionPush> pushes;
};

/// Pushes the sheet to both sides along two horizontals and the vertical by so much of its weight,
/// 0: not. Each push begins at the rest, with what friction and the cloth itself remember there.
/// `between`: residual of a weight at which all but its last step end, by Newton steps that use
/// factors again; none: every step is solved like the rest.
[[nodiscard]] std::vector<FrictionPush> push_along(StaticSolver& solver,
                                                   const Eigen::Vector3d& per_weight, int steps,
                                                   const std::optional<double>& between = {});

/// Pushes the sheet, which `solver` has brought to rest, along two horizontals, up and down by
/// slow changes of gravity, each time from the same rest. The solver is left as it was. Without
/// friction there is nothing to try and no push.
[[nodiscard]] FrictionBand push_at_rest(StaticSolver& solver, const StaticOptions& options,
                                        const PushOptions& how = {});

/// Adds `friction_band` to branches.json: each push with the displacement that it leaves at each
/// mark of the print, and per mark what they span. Everything in world coordinates.
void add_friction_band(const FrictionBand& band, const GridSpec& grid, const Print& print,
                       Json& json);

/// Per mark its place at rest and the interval that the ends leave it, as JSON; an end that counts
/// (not null) puts its moves into its entry of `ends_json`.
[[nodiscard]] Json marks_between(const Field& rest, const std::vector<const Field*>& ends,
                                 const GridSpec& grid, const Print& print, Json& ends_json);

/// Options of the search for the interval that internal friction leaves.
struct MemoryPushes {
  /// Share of the weight by which it grows and shrinks. Where nothing touches, sideways as well.
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

  /// Place in the vertical interval, summed over the particles: 0 lowest, 1 highest; nothing where
  /// no other end counts.
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
