// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/simulation_files.hpp"
#include "simulate/drape/drape.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// Single-linkage clusters: the components that remain after removing edges of the minimum
/// spanning tree longer than a limit. The limit is where an edge is an outlier: median plus 3
/// times 1.4826 times the median absolute deviation of the tree's edges (Hampel 1974), at least
/// `least`.
struct Linkage {
  double limit = 0;
  std::vector<int> group;  ///< cluster of each point, numbered by first occurrence
};
[[nodiscard]] Linkage link(int count, const std::function<double(int, int)>& distance,
                           double least);

/// Folds of a cloth's hem: its horizontal distance from the vertical through the centre of mass, as
/// a function of the fraction of the hem's material length.
struct HemLabel {
  int nodes = 0;                        ///< number of maxima with a prominence of at least 3 mm
  std::array<double, 9> amplitude_m{};  ///< Fourier amplitudes 0 .. 8 of the distance
};

/// Samples the hem of the surface at 256 points.
[[nodiscard]] HemLabel label_hem(const DrapeLevel& level, const ClothMoment& moment);

/// Options of an ensemble of starts.
struct EnsembleOptions {
  /// Number of seeded starts; absent: 8, plus 8 more while new branches appear, at most 32.
  std::optional<int> starts;
  double same_m = 1e-3;  ///< equilibria closer than this are one branch, at any density
  int threads = 1;       ///< number of threads; never changes a result
};

void fields(Fields& f, EnsembleOptions& options);

/// A drape with everything needed to judge it and state its result.
struct EnsembleCase {
  Scene scene;  ///< in world coordinates
  Fabric fabric;
  FittedLaws fitted;
  SimulateOptions options;
  std::shared_ptr<const DrapeCase> drape;

  /// Copies the case with a change of the scene, in the world and in the frame of the case.
  [[nodiscard]] EnsembleCase with(const std::function<void(Scene&)>& change) const;
  [[nodiscard]] EnsembleCase with_laws(FittedLaws laws) const;
  /// Copies the case with the first `count` levels only.
  [[nodiscard]] EnsembleCase with_levels(std::size_t count) const;

  /// "at rest", or why a state is not: its descent did not converge, or the checker refuses it.
  [[nodiscard]] std::string ending_of(const DrapeLevel& level, const ClothMoment& moment,
                                      const RestReport& report) const;
  /// Converts a drape to a result, as simulate() does.
  [[nodiscard]] SimulateResult result(Drape made) const;
};

/// Makes the case of a scene, as simulate() does.
[[nodiscard]] EnsembleCase ensemble_case(const Scene& scene, const Fabric& fabric,
                                         const Print& print, const std::optional<Sheet>& measured,
                                         const SimulateOptions& options);

/// Result of one start on the coarsest mesh, in the frame of the case.
struct Member {
  int start = -1;  ///< index for variation_of(); -1 if folded, see folded_starts()
  double friction = 0;
  Drape drape;                     ///< without its level, which all members share
  std::string ending = "at rest";  ///< "at rest", or the reason why it is not
  double energy_j = 0;             ///< includes gravity, relative to the origin of the frame
  double mass_kg = 0;
  HemLabel hem;
  Eigen::MatrixX3d marks;                 ///< positions of Ensemble::marks, one row each
  std::optional<double> from_measured_m;  ///< mean distance from the measured marks

  [[nodiscard]] bool rests() const { return ending == "at rest"; }
};

/// Equilibria of a drape from many starts.
struct Ensemble {
  int starts = 0;  ///< number of leading members from seeded starts; folded ones follow
  std::vector<Member> members;  ///< all starts, including those that do not come to rest
  std::vector<MarkId> marks;    ///< the print's marks that are on the cloth
  bool round = false;           ///< true if the scene is symmetric about a vertical axis
  double linked_m = 0;  ///< distance to a member of a branch below which an equilibrium joins it
  /// Indices of the members of each branch by energy, lowest first, but with the scene's own start
  /// in front; the first represents it. Branches are sorted by the energy of their first member.
  std::vector<std::vector<int>> branches;

  /// Starts that ended on a branch, in ascending order.
  [[nodiscard]] std::vector<int> starts_of(std::size_t branch) const;
};

/// Mean distance of the marks of two cloths (m). `round`: after the best rotation about the
/// vertical and horizontal shift, also with the cloth rotated by half a turn in its plane.
[[nodiscard]] double mean_distance_m(const Eigen::MatrixX3d& a, const Eigen::MatrixX3d& b,
                                     bool round);

/// Drapes the starts on the coarsest mesh and groups their equilibria by linkage. Without a given
/// number, stops when the last eight starts found no new branch. A cloth that is divided by the
/// line of its two pins is also started folded. Throws Error like drape_cloth().
[[nodiscard]] Ensemble find_branches(const EnsembleCase& own, const EnsembleOptions& how);

/// Estimate from the number of starts on each branch.
[[nodiscard]] UnseenBranches unseen_of(const std::vector<int>& starts);

/// Content of branches.json for an ensemble, in the world, without the measured drape.
[[nodiscard]] BranchList list_of(const Ensemble& ensemble, const EnsembleCase& own);

/// Indices of the branches that may hold the measured drape: all without a measured sheet, else
/// those whose nearest member is farther from it than the overall nearest by no more than the
/// linking distance.
[[nodiscard]] std::vector<std::size_t> could_be_real(const Ensemble& ensemble);

/// Final result for a branch.
struct FinishedBranch {
  SimulateResult result;
  Eigen::MatrixX3d marks;                 ///< as in Member
  std::optional<double> from_measured_m;  ///< as in Member
};

/// Refines the member that represents a branch on the next finer mesh, if there is one and `polish`
/// is set. `entry` receives the changes, and whether the equilibrium is stable: whether a small
/// change of forces has a first-order solution. If the refined cloth is not at rest, `entry` states
/// why and the member itself is returned.
[[nodiscard]] FinishedBranch finish_branch(const Ensemble& ensemble, std::size_t branch,
                                           const EnsembleCase& own, bool polish,
                                           ListedBranch& entry);

/// Compares the measured sheet of the case with the branches; `finished` holds the result of each.
/// The measured drape is on its nearest branch if its distance from a member is at most the linking
/// distance, and branches are farther apart than that.
[[nodiscard]] PlacedDrape place_measured(const Ensemble& ensemble, const EnsembleCase& own,
                                         const std::vector<FinishedBranch>& finished,
                                         const std::vector<BandMark>& band);

/// Drapes the cloth from the measured shape at the resolution of refined branches. The remaining
/// distance is due to model and fabric, not to the choice of folds. Repeats this at the ends of the
/// range of an unmeasured friction.
void start_from_measured(const EnsembleCase& own, PlacedDrape& placed);

/// Folded starts for a cloth on two pins, as over a washing line: either part, or both, hang down
/// from the line through the pins, straight or with half a wave between them. Such a drape has many
/// folded equilibria that a flat start rarely reaches. Empty if the pins define no line that
/// divides the cloth.
[[nodiscard]] std::vector<DrapeStart> folded_starts(const DrapeCase& drape);

}  // namespace drape::simulate
