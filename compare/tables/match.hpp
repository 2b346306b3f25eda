// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/tables/tables.hpp"

namespace drape::compare {

/// Effect of one input's uncertainty on the differences virtual - real of the marks (rows, m): at
/// one standard uncertainty below and above its value, or at the ends of a rectangular range.
/// On each side the marks move in proportion, since a fold or friction that snaps at one end tells
/// nothing of the other.
struct InputEffect {
  std::string what, origin;
  bool rectangular = false;
  Eigen::MatrixX3d down_m, up_m;
  std::string remedy = {};           ///< measure that reduces it; empty if none
  std::optional<double> own_m = {};  ///< bound of its effect, if it adds as a whole
};

/// Displacements of the marks in a drape in which all inputs err at once.
struct DrawnTogether {
  Eigen::MatrixX3d moves_m, first_order_m;  ///< as draped, and as the sum of first-order responses
};

/// Contributions to the uncertainty of the headline's mean distance.
struct BudgetInputs {
  Eigen::MatrixX3d differences_m;  ///< virtual - real of each mark
  double marks_m = 0;  ///< standard uncertainty of the mean from independent errors of the marks
  std::optional<BudgetLine> unmeasured;  ///< choice of the compared marks among those of the print
  std::vector<InputEffect> effects;
  std::vector<DrawnTogether> drawn;  ///< drapes on the ensemble's mesh
  std::vector<std::string> missing;  ///< unknown contributions, which must not count as zero

  void lack(std::string what) { missing.push_back(std::move(what)); }
};
/// Collects the contributions; `report` must have a headline.
[[nodiscard]] BudgetInputs budget_inputs_of(const DrapeInput& input, const Report& report,
                                            const std::optional<SensitivityFile>& split);

/// The list of the drape's speaking branch, with the bands of friction and internal friction;
/// nullopt if it has changed since.
[[nodiscard]] std::optional<BranchList> speaking_list(const DrapeInput& input);

/// Total uncertainty of the headline's mean distance.
[[nodiscard]] Budget budget_of(const BudgetInputs& inputs);

/// Remedy of the contribution that is largest of those that have one: "measure friction (stand-in:
/// within 50 %): it lowers U most"; empty if none has.
[[nodiscard]] std::string lowers_most(const Budget& budget);
/// Sentence: "U = 0.52 mm (95 %); largest standard deviations: mesh 0.2 mm, friction 0.1 mm".
[[nodiscard]] std::string budget_sentence(const Budget& budget);
/// Sentence on the error of the headline's mesh, or why it is unknown; empty for another simulator.
/// Without a full stop.
[[nodiscard]] std::string mesh_sentence(const DrapeInput& input, const Report& report);
/// Standard uncertainty of the mean distance due to this input alone: largest change of the mean
/// over its 95 % range (1.96 standard uncertainties; the whole of a rectangular range), divided by
/// 1.96 or sqrt(3). Where the sheets are close the mean is nonlinear, and steeper outwards.
[[nodiscard]] double alone_m(const Eigen::MatrixX3d& differences_m, const InputEffect& effect);

/// Standard uncertainty of the mean distance beyond first order: root mean square change of the
/// mean in these drapes, minus that of their first-order responses (control variates, since what
/// both have in common does not depend on the draw). Widened by Student's t with as many degrees of
/// freedom as drapes, so that 1.96 times it covers 95 %.
[[nodiscard]] double beyond_m(const Eigen::MatrixX3d& differences_m,
                              const std::vector<DrawnTogether>& drawn);

/// Amount by which errors can have lengthened a mean distance of sheets: errors across a distance
/// add to its square, so that d^2 <= true^2 + bound^2 where they displace the marks by at most
/// `bound_m`: d - (d^2 - bound^2)^(1/2), and all of d where the sheets may coincide (d <= bound).
[[nodiscard]] double lengthened_m(double mean_m, double bound_m);

/// Half width that contains the mean in 95 of 100 cases, for independent contributions: root sum of
/// squares times a coverage factor between those of the normal (1.96) and of the rectangular
/// distribution (1.645): 1.96 - 0.315 q^2.4, with q the kurtosis of the sum relative to that of a
/// rectangular one. It increases with every contribution.
[[nodiscard]] double half_width_m(const std::vector<BudgetLine>& lines);

/// Fills Report::repeats and among_repeats: the layings of the drape that repeat each other, their
/// distances, and the position of the headline among them.
void judge_repeats(const DrapeInput& input, const Options& options, Report& report);

/// Adds a NO-GO if the marks are too uncertain for the limit of the match: their median uncertainty
/// is above Options::max_sigma_ratio of the limit and of the distance compared with it. A distance
/// far beyond the limit needs no finer marks, and a small one is no fault of them. Without a limit
/// nothing is decided: the distance and its U are given.
void judge_resolution(const Options& options, Report& report);

/// Compares a value, which open contributions may change by `open_m`, with a limit (ISO 14253-1).
[[nodiscard]] Match decide(double value_m, double open_m, double limit_m);

/// Verdict on the headline. The limit is the scatter of at least kLeastRepeats real drapes, for
/// their mean distance, else the tolerance, for the mean distance from the drape's own laying. Open
/// contributions: 95 % range of the inputs plus the bounds that add as a whole. Also undecided if
/// the budget lacks a part, or if the value is outside the limit but another branch's within it.
[[nodiscard]] MatchVerdict match_of(const DrapeInput& input, const Options& options,
                                    const Report& report);

}  // namespace drape::compare
