// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/branch_list.hpp"
#include "simulate/ensemble/hem_label.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// Options of an ensemble of starts.
struct EnsembleOptions {
  /// Seeded starts; absent: 8, and 8 more while new branches come, at most 32.
  std::optional<int> starts;
  double same_m = 1e-3;  ///< nearer rests are one branch, however dense the others lie
  int threads = 1;       ///< never changes a result
};

void fields(Fields& f, EnsembleOptions& options);

/// A drape with everything that judges and states it.
struct EnsembleCase {
  Scene scene;  ///< in the world
  Fabric fabric;
  FittedLaws fitted;
  SimulateOptions options;
  std::shared_ptr<const DrapeCase> drape;

  /// A value of the scene changed, in the world and in the frame of the case.
  [[nodiscard]] EnsembleCase with(const std::function<void(Scene&)>& change) const;
  [[nodiscard]] EnsembleCase with_laws(FittedLaws laws) const;
  /// The first `count` levels of the drape's own alone.
  [[nodiscard]] EnsembleCase with_levels(std::size_t count) const;

  /// "at rest", or why a moment is no rest: its descent did not end, or the checker refuses it.
  [[nodiscard]] std::string ending_of(const DrapeLevel& level, const ClothMoment& moment,
                                      const RestReport& report) const;
  /// A drape as simulate() gives it.
  [[nodiscard]] SimulateResult result(Drape made) const;
};

/// The case of a scene, as simulate() makes it.
[[nodiscard]] EnsembleCase ensemble_case(const Scene& scene, const Fabric& fabric,
                                         const Print& print, const std::optional<Sheet>& measured,
                                         const SimulateOptions& options);

/// End of one start on the coarsest mesh, in the frame of the case.
struct Member {
  int start = -1;  ///< index for variation_of(); -1: folded, see folded_starts()
  double friction = 0;
  Drape drape;                     ///< without its level, of which all members have the same
  std::string ending = "at rest";  ///< or why it is no rest
  double energy_j = 0;             ///< gravity about the origin of the frame
  double mass_kg = 0;
  HemLabel hem;
  Eigen::MatrixX3d marks;                 ///< places of Ensemble::marks, one row each
  std::optional<double> from_measured_m;  ///< mean distance of the measured marks

  [[nodiscard]] bool rests() const { return ending == "at rest"; }
};

/// Rests of a drape from many starts.
struct Ensemble {
  int starts = 0;               ///< the first members, in their order; folded ones follow
  std::vector<Member> members;  ///< all starts, also those that do not rest
  std::vector<MarkId> marks;    ///< marks of the print that are on the cloth
  bool round = false;           ///< the scene looks the same turned about a vertical axis
  double linked_m = 0;          ///< rests nearer than this to any member of a branch are on it
  /// Indices of the members of each branch by energy, lowest first, but the scene's own start
  /// before all; the first names it. Branches are in the order of the energies of their first.
  std::vector<std::vector<int>> branches;

  /// Starts that ended on a branch, ascending.
  [[nodiscard]] std::vector<int> starts_of(std::size_t branch) const;
};

/// True if all objects are round about one vertical axis.
[[nodiscard]] bool is_round(const Scene& scene);

/// Mean distance of two cloths' marks (m); `round`: after the best turn about the vertical and
/// horizontal shift, and with the cloth turned by half a turn in its own plane as well.
[[nodiscard]] double mean_distance_m(const Eigen::MatrixX3d& a, const Eigen::MatrixX3d& b,
                                     bool round);

/// Drapes the starts on the coarsest mesh and groups their rests by linkage (linkage.hpp). Without
/// a number of starts it ends when the last eight brought no new branch. A cloth on two pins that
/// part it falls folded as well. Throws Error as drape_cloth() does.
[[nodiscard]] Ensemble find_branches(const EnsembleCase& own, const EnsembleOptions& how);

/// Estimate by the number of starts on each branch.
[[nodiscard]] UnseenBranches unseen_of(const std::vector<int>& starts);

/// branches.json of an ensemble, in the world; of the real drape nothing.
[[nodiscard]] BranchList list_of(const Ensemble& ensemble, const EnsembleCase& own);

/// Indices of the branches that could be the real drape: all without a measured sheet; else those
/// whose nearest member is farther from it than the nearest of all by no more than rests of one
/// branch are linked by.
[[nodiscard]] std::vector<std::size_t> could_be_real(const Ensemble& ensemble);

/// A branch as it is given.
struct FinishedBranch {
  SimulateResult result;
  Eigen::MatrixX3d marks;                 ///< as of a member
  std::optional<double> from_measured_m;  ///< the same
};

/// Takes the member that names a branch, polished on the next finer mesh where there is one and
/// `polish`; `entry` takes what that changes, and whether the rest is stable: whether a small
/// change of forces has a first-order answer. Where the polished cloth is no rest, `entry` says why
/// and the member itself is given.
[[nodiscard]] FinishedBranch finish_branch(const Ensemble& ensemble, std::size_t branch,
                                           const EnsembleCase& own, bool polish,
                                           ListedBranch& entry);

/// Places the measured sheet, which the case has, among the branches. `finished`: of each branch.
/// The real drape is on its nearest branch when it is no farther from one of its members than
/// members are linked by, and branches lie farther apart.
[[nodiscard]] PlacedDrape place_measured(const Ensemble& ensemble, const EnsembleCase& own,
                                         const std::vector<FinishedBranch>& finished,
                                         const std::vector<BandMark>& band);

/// Drapes the cloth from the measured shape, as finely as branches are polished: the distance that
/// is left is the model's and the fabric's, without the luck of folds; also at the ends of the
/// range of a friction that nobody measured.
void start_from_measured(const EnsembleCase& own, PlacedDrape& placed);

}  // namespace drape::simulate
