// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include <optional>
#include <string>
#include <vector>

#include "compare/tables/error_split.hpp"
#include "compare/tables/tables.hpp"

namespace drape::compare {

/// Effect of one input's uncertainty on the differences virtual - real of the marks (rows, m): at
/// one standard uncertainty below and above its value, or at the ends of a rectangular range.
/// Between and beyond them the marks follow the parabola through the three.
struct InputEffect {
  std::string what, origin;
  bool rectangular = false;
  Eigen::MatrixX3d down_m, up_m;
  std::string remedy = {};           ///< lowers it; empty: nothing does
  std::optional<double> own_m = {};  ///< of the simulation's own error: bound of its effect
};

/// Moves of the marks in a drape where all inputs err at once.
struct DrawnTogether {
  Eigen::MatrixX3d moves_m, first_order_m;  ///< as draped; by the sum of the first-order answers
};

/// Grounds of the mean distance of the headline.
struct BudgetInputs {
  Eigen::MatrixX3d differences_m;  ///< virtual - real of each mark
  double marks_m = 0;              ///< standard uncertainty of the mean, each mark by itself
  std::vector<InputEffect> effects;
  std::vector<DrawnTogether> drawn;  ///< on the ensemble's mesh
  std::vector<std::string> missing;  ///< never taken as zero in silence

  void lack(std::string what) { missing.push_back(std::move(what)); }
};
/// `report` has a headline.
[[nodiscard]] BudgetInputs budget_inputs_of(const DrapeInput& input, const Report& report,
                                            const std::optional<SensitivityFile>& split);

/// The list of the drape's speaking branch, with the bands of friction and internal friction;
/// nothing when it is another one by now.
[[nodiscard]] std::optional<BranchList> speaking_list(const DrapeInput& input);

/// Total uncertainty of the headline's mean distance.
[[nodiscard]] Budget budget_of(const BudgetInputs& inputs);

/// One row per contribution, the largest first, and the total.
[[nodiscard]] Table budget_table(const Budget& budget);
/// "U = 0.52 mm (95 %), most of it from the mesh, friction and the place of object 1".
[[nodiscard]] std::string budget_sentence(const Budget& budget);
/// The error that the headline's mesh may leave, or why it is not known; empty of another
/// simulator. Without a full stop.
[[nodiscard]] std::string mesh_sentence(const DrapeInput& input, const Report& report);
/// "5.10 mm: 0.30 without a turn of 2.4 degrees and a shift of 3.2 mm, 0.5 of shape".
[[nodiscard]] std::string distance_sentence(const RealVirtual& row);

/// Standard uncertainty of the mean distance where this input alone errs: the farthest that its
/// 95 % range (1.96 standard uncertainties; the whole of a rectangular range) takes the mean, over
/// 1.96 or sqrt(3). Where the sheets lie near each other the mean bends, and is steeper outwards.
[[nodiscard]] double alone_m(const Eigen::MatrixX3d& differences_m, const InputEffect& effect);

/// Standard uncertainty of the mean distance beyond first order: the root of the mean square that
/// the mean changes by in these drapes, less that of their first-order answers (control variates:
/// what both have in common does not depend on the draw). Widened by Student's t with as many
/// degrees of freedom as drapes, so that 1.96 of it hold 95 %.
[[nodiscard]] double beyond_m(const Eigen::MatrixX3d& differences_m,
                              const std::vector<DrawnTogether>& drawn);

/// Half width that holds the mean in 95 of 100 cases, of independent contributions: the root of the
/// sum of the squares times a coverage factor between those of the normal (1.96) and of the
/// rectangular distribution (1.645): 1.96 - 0.315 q^2.4, q the kurtosis of the sum over that of a
/// rectangular one. It grows with every contribution.
[[nodiscard]] double half_width_m(const std::vector<BudgetLine>& lines);

}  // namespace drape::compare
