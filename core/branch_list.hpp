// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

namespace drape {

/// One equilibrium shape among the several that a drape can have.
struct ListedBranch {
  int number = 0;       ///< rank by energy; branch 1 has the least
  std::string sheet;    ///< path from the folder of the list
  double energy_j = 0;  ///< on the coarsest mesh; only differences within one list are meaningful
  double residual = 0;  ///< largest net force on a free particle, in mean particle weights
  bool stable = true;   ///< false at a saddle point of the energy
  std::vector<int> starts;
  double fraction = 0;         ///< fraction of the starts
  std::optional<bool> sought;  ///< true if only the search found it: no start ended there
  double friction = 0;
  double farthest_member_m = 0;
  int hem_nodes = 0;                     ///< number of folds along the hem
  std::vector<double> hem_amplitudes_m;  ///< Fourier amplitudes of the hem's radius, orders 0 to 8
  std::optional<double> spacing_m;       ///< spacing of the mesh of `sheet`
  std::optional<double> polish_m;        ///< mean move of the marks from the coarsest mesh, if any
  std::string not_polished;              ///< why no refined equilibrium is given
};

/// Estimated probability that a further start ends on a branch not yet seen: the fraction of starts
/// that are alone on their branch (Good 1953, Good-Turing estimate).
struct UnseenBranches {
  int rests = 0;        ///< starts that ended in an equilibrium
  int seen_once = 0;    ///< branches reached by exactly one start
  double fraction = 0;  ///< seen_once / rests
  double upper95 = 1;   ///< its upper 95 % bound (Clopper and Pearson 1934); 3 / rests for none
};

struct RefusedStarts {
  std::vector<int> starts;
  std::string why;
};

/// Region of one mark in 95 % of an ensemble's drapes.
struct BandMark {
  MarkId mark;
  Eigen::Vector3d mean_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d low_in_world = Eigen::Vector3d::Zero();   ///< 2.5 % quantile per axis
  Eigen::Vector3d high_in_world = Eigen::Vector3d::Zero();  ///< 97.5 % quantile per axis
  double radius95_m = 0;  ///< radius about the mean that holds 95 % of the drapes
};

/// Matrix of these moves, one row per mark.
[[nodiscard]] Eigen::MatrixX3d one_a_row(const std::vector<Eigen::Vector3d>& moves);

/// Another equilibrium of the scene's own drape, reached by a push or by another loading history.
struct OtherRest {
  std::string what;    ///< name of the loading history; empty for a push in a friction band
  std::string ending;  ///< "at rest", or why it counts for nothing
  std::optional<Eigen::Vector3d> push_per_weight;  ///< largest push in world axes, in cloth weights
  std::optional<std::vector<Eigen::Vector3d>> moves_m;  ///< move of each mark; absent if uncounted

  [[nodiscard]] Eigen::MatrixX3d moves() const;  ///< same moves, one row per mark
};

/// Range of one mark's positions over this equilibrium and all others, per axis.
struct MarkInterval {
  MarkId mark;
  Eigen::Vector3d rest_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d low_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_in_world = Eigen::Vector3d::Zero();
};

/// Range of positions in which friction holds the drape of the scene's start, sampled by pushes.
struct FrictionBand {
  double friction = 0;
  std::vector<OtherRest> pushes;     ///< each push grew and was released; empty without friction
  std::vector<OtherRest> ends = {};  ///< same start, with the scene's friction_ends()
  std::vector<MarkInterval> marks;

  [[nodiscard]] int counted() const;
  /// Largest displacement of each mark from its equilibrium after any push.
  [[nodiscard]] std::vector<double> reach_m() const;
};

/// Range of positions in which internal friction holds the drape, sampled by loading histories.
struct MemoryBand {
  std::optional<double> place_of_rest;  ///< 0 lowest, 1 highest; absent if no other end counts
  std::vector<OtherRest> ends;
  std::vector<MarkInterval> marks;

  /// Moves at the end with the lowest (highest) mean height; zero if that is the drape's own.
  [[nodiscard]] Eigen::MatrixX3d lowest_m() const { return extreme_m(-1); }
  [[nodiscard]] Eigen::MatrixX3d highest_m() const { return extreme_m(1); }

 private:
  [[nodiscard]] Eigen::MatrixX3d extreme_m(double sign) const;
};

/// Equilibrium of the scene's own start with errors in all stated values, and its displacement.
struct ErringRest {
  std::string ending;                                   ///< "at rest", or why it counts for nothing
  std::optional<std::vector<Eigen::Vector3d>> moves_m;  ///< per mark; absent if not counted
  std::optional<std::vector<Eigen::Vector3d>> first_order_m;  ///< first-order response, likewise
};

/// Such equilibria on the coarsest mesh, each with its own errors: effects of friction, folds and
/// edges beyond the first-order responses.
struct BeyondFirstOrder {
  std::vector<MarkId> marks_at;  ///< rows of the moves
  std::vector<ErringRest> rests;
};

/// Result of a start from the measured shape with another friction coefficient.
struct OtherFriction {
  double friction = 0;
  std::string ending;                ///< "at rest", or why it counts for nothing
  std::optional<double> distance_m;  ///< mean over the marks
};

/// Position of the measured drape relative to the branches.
struct PlacedDrape {
  std::optional<int> branch;  ///< absent if on no branch, or if it cannot be assigned (`reach_m`)
  std::optional<int> nearest;
  std::optional<double> distance_m;  ///< mean over the marks of the distance to the nearest member
  /// Distance below which a drape counts as on a branch. Absent for a single branch, or if the
  /// branches are no farther apart than that and the assignment is meaningless.
  std::optional<double> reach_m;
  std::optional<int> marks;
  std::optional<double> inside_fraction;  ///< fraction of the marks inside their bands
  std::string started_there;              ///< result of a start from the measured shape
  std::optional<double> started_there_m;  ///< mean distance to the measured drape after that start
  /// Starts from the measured shape at both ends of an unmeasured friction's range.
  std::vector<OtherFriction> other_frictions = {};
  std::optional<double> apart_m = {};  ///< distance between the nearest branch and the next one
};

/// branches.json: the equilibria of one drape, from an ensemble of starts.
struct BranchList {
  bool round = false;            ///< true if the scene is symmetric about a vertical axis
  double linked_m = 0;           ///< equilibria closer than this are one branch
  std::vector<int> not_at_rest;  ///< starts that did not come to rest
  std::vector<RefusedStarts> refused;
  std::vector<ListedBranch> branches;  ///< in order of energy, lowest first
  std::optional<int> starts;           ///< number of seeded starts; absent if not stated
  std::optional<UnseenBranches> unseen;
  std::optional<int> members_at_rest;  ///< absent if no ensemble was run
  std::vector<BandMark> band;          ///< empty for fewer than 20 members at rest
  std::optional<FrictionBand> friction_band;
  std::optional<MemoryBand> memory_band;
  std::optional<BeyondFirstOrder> beyond_first_order;
  std::optional<PlacedDrape> measured;
  Document document;
};
template <>
inline constexpr Format format_of<BranchList>{
    "branches", Syntax::json, 1,
    "branches.json: the equilibria of one drape, from an ensemble of starts."};

void fields(Fields& f, BranchList& list);

}  // namespace drape
