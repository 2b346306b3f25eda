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
};

/// Grounds of the mean distance of the headline.
struct BudgetInputs {
  Eigen::MatrixX3d differences_m;  ///< virtual - real of each mark
  double marks_m = 0;              ///< standard uncertainty of the mean, each mark by itself
  std::vector<InputEffect> effects;
  std::vector<std::string> missing;  ///< never taken as zero in silence

  void lack(std::string what) { missing.push_back(std::move(what)); }
};
/// `report` has a headline.
[[nodiscard]] BudgetInputs budget_inputs_of(const DrapeInput& input, const Report& report,
                                            const std::optional<SensitivityFile>& split);

/// The list of the drape's speaking branch, with the bands of friction and internal friction;
/// nothing when it is another one by now.
[[nodiscard]] std::optional<BranchList> speaking_list(const DrapeInput& input);

/// Total uncertainty of the headline's mean distance by propagation of distributions (JCGM 101)
/// over all inputs together, each mark followed in space.
[[nodiscard]] Budget budget_of(const BudgetInputs& inputs, int draws = 10000);

/// One row per contribution, the largest first, and the total.
[[nodiscard]] Table budget_table(const Budget& budget);
/// "U = 0.52 mm (95 %), most of it from the mesh, friction and the place of object 1".
[[nodiscard]] std::string budget_sentence(const Budget& budget);
/// The error that the headline's mesh may leave, or why it is not known; empty of another
/// simulator. Without a full stop.
[[nodiscard]] std::string mesh_sentence(const DrapeInput& input, const Report& report);
/// "5.10 mm: 0.30 without a turn of 2.4 degrees and a shift of 3.2 mm, 0.5 of shape".
[[nodiscard]] std::string distance_sentence(const RealVirtual& row);

/// Standard deviation of the mean distance where this input alone errs, about its value as it
/// stands (Gauss quadrature of order five).
[[nodiscard]] double alone_m(const Eigen::MatrixX3d& differences_m, const InputEffect& effect);

/// Half width about the mean distance, the larger of two. Of all inputs drawn together (JCGM 101),
/// 95 of 100 draws deviate by at most the first. The second (bootstrap-t; Efron 1981, Hall 1988) is
/// the standard deviation at the stated values times what 95 of 100 draws deviate by, each over the
/// standard deviation where it lies. A mean of norms bends where the sheets lie near each other:
/// stated values that bring them nearer by chance make its slopes and so the first too small, and
/// draws that lie farther apart, where it is steeper, make the second too small.
/// `added_m`: standard uncertainty of the mean that is no input's. The draws are the same in every
/// call.
[[nodiscard]] double half_width_m(const Eigen::MatrixX3d& differences_m,
                                  const std::vector<InputEffect>& effects, double added_m,
                                  int draws = 10000);

}  // namespace drape::compare
