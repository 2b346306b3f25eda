// SPDX-License-Identifier: Apache-2.0
#include "calib/programs/drift_ending.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "calib/checks/drift.hpp"

namespace drape::calib {

void add_drift(Ending& ending, const Calibration& old, const Calibration& now, const Rig& rig,
               const Target& target) {
  if (old.no_go)
    ending.warnings.push_back("the old calibration is NO-GO, so the drift since it is uncertain: " +
                              *old.no_go);
  const Eigen::Vector3d corner =
      target.point_in_target({target.rows - 1, target.cols - 1}).cwiseAbs();
  double top_m = 0;
  for (const TargetStage& stage : rig.stages) top_m = std::max(top_m, stage.z_m);
  const Drift drift = drift_between(
      old, now, grid_of({{-corner.x(), -corner.y(), 0}, {corner.x(), corner.y(), top_m}}, 3));
  for (const CameraDrift& camera : drift.cameras) {
    ending.numbers.emplace_back(
        camera.camera + " since the old calibration",
        fmt::format("its images moved by {:.3f} px RMS, {:.3f} px expected by the uncertainties",
                    camera.moved_px, camera.expected_px));
    if (!camera.drifted()) continue;
    ending.rejected.push_back(fmt::format(
        "{} drifted since the old calibration: {:.3f} px RMS where {:.3f} px are expected; what "
        "was "
        "measured between the two is less certain than stated, clamp the camera and its lens",
        camera.camera, camera.moved_px, camera.expected_px));
  }
  if (drift.cameras.size() > 1) {
    ending.numbers.emplace_back(
        "a measured point since then",
        fmt::format("{:.4f} mm RMS, {:.4f} mm expected", drift.moved_mm, drift.expected_mm));
  }
  for (const std::string& camera : drift.not_in_old)
    ending.rejected.push_back(camera + " is not in the old calibration");
}

}  // namespace drape::calib
