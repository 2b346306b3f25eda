// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/joint/fit.hpp"

namespace drape::calib {

/// Names the camera whose lens is too wide for Brown's model at some picture size; empty if there
/// is none. Two tests: an equidistant fisheye lens combined with Brown's terms fits the camera's
/// own views with residuals below 1/sqrt(2) (half the squares), or a further radial term changes
/// the focal length by more than three stated standard deviations, judged by the views' scatter.
[[nodiscard]] std::string wide_lens(const JointModel& model, JointFit fit);

}  // namespace drape::calib
