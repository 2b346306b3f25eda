// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace drape::compare {

/// What one input's uncertainty does to the differences virtual - real of the marks (rows, m): at
/// one standard uncertainty below and above its value, or at the ends of a rectangular range.
/// Between and beyond them the marks follow the parabola through the three.
struct InputEffect {
  std::string what, origin;
  bool rectangular = false;
  Eigen::MatrixX3d down_m, up_m;
};

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
