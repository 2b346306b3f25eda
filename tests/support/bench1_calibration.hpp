// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/calibration.hpp"
#include "tests/support/bench1_truth.hpp"

namespace drape::test {

/// The true cameras of bench1 as a calibration, with the world's origin as worked point.
[[nodiscard]] inline Calibration bench1_true_calibration() {
  Calibration calibration;
  calibration.method = "tsai";
  calibration.rig = "bench1";
  for (const Camera& camera : bench1_truth().cameras) {
    CalibratedCamera& calibrated = calibration.cameras.emplace_back();
    calibrated.camera = camera;
    calibrated.worked_point.point_in_world.setZero();
    calibrated.worked_point.px =
        project(camera.model, camera.cam_from_world * calibrated.worked_point.point_in_world)->px;
  }
  return calibration;
}

}  // namespace drape::test
