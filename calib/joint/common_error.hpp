// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/joint/solve.hpp"

namespace drape::calib {

/// Detections are not quite independent: light, blur and sampling leave an error that all points
/// of a view share. It is taken for a smooth one, any quadratic function of the place on the
/// target in u and in v, whose six orthonormal shapes each have the standard deviation `share`
/// times that of the view's points. Their poses take most of it up, so that residuals hardly show
/// it, while cameras feel it as if it were true. Returns J'W C W J of all views' shared errors, for
/// the parameters of information_of().
[[nodiscard]] Eigen::MatrixXd common_error_pull(const JointModel& model, const JointFit& fit,
                                                double share);

/// The six shapes at a frame's points, orthogonal, each with a mean square of 1 (n x 6; fewer
/// columns when the points do not tell six apart).
[[nodiscard]] Eigen::MatrixXd smooth_shapes(const JointFrame& frame);

}  // namespace drape::calib
