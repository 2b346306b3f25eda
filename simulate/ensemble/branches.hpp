// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"
#include "simulate/ensemble/friction_band.hpp"
#include "simulate/equilibrium/run.hpp"

namespace drape::simulate {

/// Departure of one start from the scene's in what an operator cannot know; as it stands: the
/// scene's own.
struct StartVariation {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< added to the start's place
  double friction_factor = 1;                         ///< factor of the scene's coefficient
  std::optional<double> damping_per_s;                ///< damping of the fall

  double noise_m = 0;   ///< height of random waves
  double tilt_rad = 0;  ///< about a horizontal axis
  double tilt_axis_rad = 0;
  double yaw_rad = 0;
  double lift_m = 0;  ///< added drop height
  int folds = 0;      ///< waves seeded around the sheet
  double fold_m = 0;  ///< their height at the corners' distance
  double fold_phase_rad = 0;
};

/// Start `index` of a seeded sequence; 0 is the scene's own start. The same for every run.
/// `friction_known`: the coefficient was measured and varies by a tenth, else by half to double.
[[nodiscard]] StartVariation variation_of(int index, bool friction_known = true);
void apply(const StartVariation& variation, const GridSpec& grid, Field& position);

/// Folds of the sheet's border: its horizontal distance from the vertical through the sheet's
/// middle, over the fraction of the border's length.
struct HemLabel {
  int nodes = 0;                        ///< folds: maxima that stand out by 3 mm
  std::array<double, 9> amplitude_m{};  ///< Fourier amplitudes 0 .. 8 of that distance
};
[[nodiscard]] HemLabel label_hem(const GridSpec& grid, const Field& position);

/// One equilibrium, found from one or more starts.
struct Branch {
  Field position;
  ClothMemory memory = {};  ///< state of internal friction
  StaticReport report;
  double energy_j = 0;  ///< gravity, elastic and contact, against the world origin
  HemLabel hem;
  std::vector<int> starts;
  int own_start = 0;    ///< that `position` is from; -1: none, it was sought, see seek_valleys()
  double friction = 0;  ///< friction of that start
  double spread_m = 0;  ///< farthest of its members from `position`, mean over the particles
  std::vector<Branch> others = {};  ///< its other members, each alone, by energy
};

struct BranchOptions {
  int starts = 32;
  double same_m = 1e-3;  ///< nearer rests are one branch, however dense the others lie
  int kicks = 384;       ///< tries of the search for lower rests of a sheet that touches nothing
};

/// Starts that ended still, but where no sheet can rest; none of a rest that was sought.
struct RefusedStarts {
  std::vector<int> starts;
  std::string why;
};

struct Branches {
  std::vector<Branch> found;           ///< by energy, lowest first
  std::vector<int> not_at_rest;        ///< starts that did not come to rest
  std::vector<RefusedStarts> refused;  ///< still, but in an object or refused by the checker
  bool round = false;   ///< the scene looks the same when turned about a vertical axis
  double linked_m = 0;  ///< rests nearer than this to any member of a branch are on it
  /// By start; empty where it did not rest or was refused.
  std::vector<Field> members;
  /// About the rest of the scene's own start; absent where that is none or touches nothing. A push
  /// that leaves it BranchOptions::same_m or more away on average has taken it to another branch.
  std::optional<FrictionBand> friction_band;
  /// The same of internal friction, for a cloth that has it; farther than MemoryBand::reach_m() or
  /// with other folds of the hem is another branch.
  std::optional<MemoryBand> memory_band;

  /// Takes a branch's lowest member out, so that the next one names it; returns its start, none of
  /// one that was sought.
  std::vector<int> drop_lowest(Branch& branch);
};

/// True if all objects are round about one vertical axis.
[[nodiscard]] bool is_round(const Scene& scene);
/// Mean distance of two sheets' particles; `round`: after the best turn about the vertical and
/// shift along it none, and with the sheet turned by half a turn in its own plane as well.
[[nodiscard]] double mean_distance_m(const Field& a, const Field& b, bool round);
/// The ensemble's; where it touches nothing, lower ones too, if seek_valleys() finds any: what
/// hangs free is held on its valley by nothing but its history. Not with internal friction: there
/// the history decides, and `without` are the laws of the same fabric without it.
[[nodiscard]] Branches find_branches(const StaticCase& the_case, const ClothLaws& without,
                                     const GridSpec& grid, const StaticOptions& options,
                                     const BranchOptions& how);
/// Schema drapebench/branches/1, without what EnsembleReport adds.
[[nodiscard]] Json branches_json(const Branches& branches);

struct BranchResult {
  Branches branches;
  std::vector<Sheet> sheets;  ///< one for each of branches.found
};

/// Equilibria of a drape; a branch is named by its lowest member that simulate_checked() would
/// accept; `options` as for
/// simulate() with the solver "static" or "fall". Throws Error for wrong input.
[[nodiscard]] BranchResult simulate_branches(const Scene& scene, const Fabric& fabric,
                                             const Print& print,
                                             const std::optional<Sheet>& measured,
                                             const SimulateOptions& options,
                                             const BranchOptions& how);

}  // namespace drape::simulate
