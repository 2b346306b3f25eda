// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/joint/fit.hpp"

namespace drape::calib {

/// Names the camera whose lens is wider than Brown's model, at any picture size; empty when there
/// is none. Two tests: an equidistant fisheye lens under Brown's terms fits the camera's own views
/// with less than 1/sqrt(2) of the misses (half the squares), or one radial term more moves the
/// focal length by more than three stated standard deviations, judged by the views' own scatter.
[[nodiscard]] std::string wide_lens(const JointModel& model, JointFit fit);

}  // namespace drape::calib
