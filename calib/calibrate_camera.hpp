// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "calib/calib.hpp"
#include "calib/tsai/correspondence.hpp"

namespace drape::calib {

struct CameraResult {
  std::optional<CalibratedCamera> calibrated;  ///< absent when there is nothing to write
  CameraReport report;
};

/// All stages of Tsai's method for one camera; see calibrate_tsai().
[[nodiscard]] CameraResult calibrate_camera(const std::vector<Correspondence>& points,
                                            const RigCamera& rig_camera, double dot_diameter_m,
                                            bool estimate_scale_x, const CalibOptions& options);

}  // namespace drape::calib
