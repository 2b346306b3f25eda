// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/acceptance/positions.hpp"

namespace drape::calib {

/// Cameras that are exchanged or mirrored, or a plate whose labels are: what to say of it, empty
/// where the cameras agree or nothing simple explains why they do not.
[[nodiscard]] std::string exchanged_or_mirrored(const Detections& detections,
                                                const Calibration& calibration, const Plate& plate,
                                                const std::vector<Position>& positions);

}  // namespace drape::calib
