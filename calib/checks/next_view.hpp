// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/joint/solve.hpp"

namespace drape::calib {

/// One sentence: which further pose of the target would lower the calibration's share of the
/// measured points' standard deviation most, and by how much (from the information it would add).
/// `common` is common_error_pull() of the views there are, or empty.
[[nodiscard]] std::string next_view(const JointModel& model, const JointFit& fit,
                                    const Eigen::MatrixXd& common, double variance_factor);

}  // namespace drape::calib
