// SPDX-License-Identifier: Apache-2.0
#include "calib/calib.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "calib/calibrate_camera.hpp"
#include "calib/checks/known_length.hpp"
#include "calib/checks/pictures.hpp"
#include "calib/tsai/correspondence.hpp"
#include "core/error.hpp"

namespace drape::calib {
namespace {

void check_positive(const char* option, double value) {
  if (!(value > 0)) {
    throw usage_error(fmt::format("{} is {}", option, value), "give a number above zero");
  }
}

}  // namespace

void CalibOptions::check() const {
  check_positive("--max-rms-px", max_rms_px);
  check_positive("--max-centre-sd-px", max_centre_sd_px);
  check_positive("--max-focal-sd-percent", max_focal_sd_percent);
  check_positive("--outlier-sigmas", outlier_sigmas);
  check_positive("--max-iterations", max_iterations);
  if (!(max_outliers_percent >= 0)) {
    throw usage_error(fmt::format("--max-outliers-percent is {}", max_outliers_percent),
                      "give zero or more");
  }
}

bool CalibReport::good() const {
  return std::all_of(cameras.begin(), cameras.end(),
                     [](const CameraReport& camera) { return camera.good(); });
}

CalibResult calibrate_tsai(const Detections& detections, const Rig& rig, const Target& target,
                           const CalibOptions& options) {
  options.check();
  check_known_length(target);
  refuse_sets_twice(rig);
  if (rig.stages.empty())
    throw bad_input(
        "there are no z stages, on which Tsai's method rests", {.field = "calibration.stage"},
        "calibrate with --method joint, or add [[calibration.stage]] with set and z_mm");
  CalibResult result;
  result.calibration.method = "tsai";
  result.calibration.rig = rig.name;
  for (const TargetStage& stage : rig.stages) result.calibration.sets.push_back(stage.set);
  refuse_pictures_twice({detections, "", result.calibration.sets});
  for (const RigCamera& rig_camera : rig.cameras) {
    const auto points = stage_correspondences(detections, rig, target, rig_camera.name);
    CameraResult camera =
        calibrate_camera(points, rig_camera, target.dot_diameter_m, rig.estimate_scale_x, options);
    if (!camera.report.good()) {
      result.calibration.warnings.push_back(
          fmt::format("{}: {}", camera.report.camera, camera.report.status));
    }
    for (const std::string& note : camera.report.notes)
      result.calibration.warnings.push_back(fmt::format("{}: {}", camera.report.camera, note));
    if (camera.report.stages) {
      for (const std::string& finding : camera.report.stages->findings)
        result.calibration.warnings.push_back(fmt::format("{}: {}", camera.report.camera, finding));
    }
    for (const std::string& rejected : camera.report.rejected) {
      result.calibration.warnings.push_back(
          fmt::format("{}: rejected {}", camera.report.camera, rejected));
    }
    if (camera.calibrated) result.calibration.cameras.push_back(*camera.calibrated);
    result.report.cameras.push_back(std::move(camera.report));
  }
  return result;
}

}  // namespace drape::calib
