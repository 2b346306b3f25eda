// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

namespace drape {

/// One equilibrium of a drape that has several.
struct ListedBranch {
  int number = 0;       ///< 1 has the least energy
  std::string sheet;    ///< path from the folder of the list
  double energy_j = 0;  ///< on the coarsest mesh; only differences within one list mean anything
  double residual = 0;  ///< largest, in mean weights of a point
  bool stable = true;   ///< false: a saddle
  std::vector<int> starts;
  double fraction = 0;         ///< fraction of the starts
  std::optional<bool> sought;  ///< no start ended there; absent: one did
  double friction = 0;
  double farthest_member_m = 0;
  int hem_nodes = 0;                     ///< folds of the border
  std::vector<double> hem_amplitudes_m;  ///< Fourier amplitudes of its radius, orders 0 to 8
  std::optional<double> spacing_m;       ///< spacing of the mesh of `sheet`
  std::optional<double> polish_m;  ///< mean move of the marks from the coarsest mesh; absent: none
  std::string not_polished;        ///< why its rest on the finer mesh is not given
};

/// Fraction of starts that would end on branches that the starts so far have not shown, estimated
/// by those that one start alone has shown (Good 1953).
struct UnseenBranches {
  int rests = 0;        ///< starts on branches
  int seen_once = 0;    ///< branches with one start
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
  Eigen::Vector3d low_in_world = Eigen::Vector3d::Zero();   ///< 2.5 % per axis
  Eigen::Vector3d high_in_world = Eigen::Vector3d::Zero();  ///< 97.5 % per axis
  double radius95_m = 0;                                    ///< about the mean
};

/// A rest of the scene's own drape after a push, or after another past.
struct OtherRest {
  std::string what;    ///< name of that past; empty for a push of a friction band
  std::string ending;  ///< "at rest", or why it counts for nothing
  std::optional<Eigen::Vector3d> push_per_weight;       ///< largest, in the world
  std::optional<std::vector<Eigen::Vector3d>> moves_m;  ///< move of each mark; absent: no count

  [[nodiscard]] Eigen::MatrixX3d moves() const;  ///< one row a mark
};

/// Places of one mark over the rest and all other rests, per axis.
struct MarkInterval {
  MarkId mark;
  Eigen::Vector3d rest_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d low_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_in_world = Eigen::Vector3d::Zero();
};

/// Interval in which friction holds the drape of the scene's own start, as far as pushes show.
struct FrictionBand {
  double friction = 0;
  std::vector<OtherRest> pushes;     ///< each grew and went again; none without friction
  std::vector<OtherRest> ends = {};  ///< of the same start with the scene's friction_ends()
  std::vector<MarkInterval> marks;

  [[nodiscard]] int counted() const;
  /// Farthest that a push left each mark from its rest.
  [[nodiscard]] std::vector<double> reach_m() const;
};

/// Interval in which internal friction holds the same drape, as far as other pasts show.
struct MemoryBand {
  std::optional<double> place_of_rest;  ///< 0 lowest, 1 highest; absent: no other end counts
  std::vector<OtherRest> ends;
  std::vector<MarkInterval> marks;

  /// The end that lies lowest and the one that lies highest on average, the rest itself among them.
  [[nodiscard]] Eigen::MatrixX3d lowest_m() const { return extreme_m(-1); }
  [[nodiscard]] Eigen::MatrixX3d highest_m() const { return extreme_m(1); }

 private:
  [[nodiscard]] Eigen::MatrixX3d extreme_m(double sign) const;
};

/// End of a start from the real shape with another friction.
struct OtherFriction {
  double friction = 0;
  std::string ending;                ///< "at rest", or why it counts for nothing
  std::optional<double> distance_m;  ///< mean over the marks
};

/// The real drape among the branches.
struct PlacedDrape {
  std::optional<int> branch;  ///< absent: it is on none, or nothing can be said (`reach_m`)
  std::optional<int> nearest;
  std::optional<double> distance_m;  ///< mean over the marks, to the nearest member
  /// Distance up to which a drape is on a branch; absent where branches are not farther apart, or
  /// there is one alone: being on it says nothing.
  std::optional<double> reach_m;
  std::optional<int> marks;
  std::optional<double> inside_fraction;  ///< fraction of the marks inside their bands
  std::string started_there;              ///< end of a start from the real shape
  std::optional<double> started_there_m;  ///< mean distance that it leaves
  /// Starts from the real shape at the ends of the range of a friction that nobody measured.
  std::vector<OtherFriction> other_frictions = {};
  std::optional<double> apart_m = {};  ///< distance of the nearest branch from the next one
};

/// branches.json: the equilibria of one drape, from an ensemble of starts.
struct BranchList {
  bool round = false;            ///< the scene looks the same turned about a vertical axis
  double linked_m = 0;           ///< nearer rests are one branch
  std::vector<int> not_at_rest;  ///< starts
  std::vector<RefusedStarts> refused;
  std::vector<ListedBranch> branches;  ///< by energy, lowest first
  std::optional<int> starts;           ///< seeded starts; absent: not stated
  std::optional<UnseenBranches> unseen;
  std::optional<int> members_at_rest;  ///< absent: no ensemble
  std::vector<BandMark> band;          ///< empty below 20 members at rest
  std::optional<FrictionBand> friction_band;
  std::optional<MemoryBand> memory_band;
  std::optional<PlacedDrape> measured;
  Document document;
};
template <>
inline constexpr Format format_of<BranchList>{
    "branches", Syntax::json, 1,
    "branches.json: the equilibria of one drape, from an ensemble of starts."};

void fields(Fields& f, BranchList& list);

}  // namespace drape
