// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/joint/solve.hpp"

namespace drape::calib {

/// One sentence: which further pose of the target would lower the calibration's part of the
/// measured points' standard deviation most, and by how much (from the information it would add).
/// `now_mm` is that part as stated today; the gain is that of the points' own noise.
[[nodiscard]] std::string next_view(const JointModel& model, const JointFit& fit, double now_mm);

}  // namespace drape::calib
