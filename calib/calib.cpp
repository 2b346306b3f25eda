// SPDX-License-Identifier: Apache-2.0
#include "calib/calib.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "calib/calibrate_camera.hpp"
#include "calib/checks/known_length.hpp"
#include "calib/checks/pictures.hpp"
#include "calib/tsai/correspondence.hpp"
#include "core/error.hpp"
#include "core/fields/records.hpp"

namespace drape::calib {
void fields(Fields& f, CalibOptions& o) {
  f.otherwise({"max_rms_px", "NO-GO above this RMS of a camera, px", 1, above_zero}, o.max_rms_px);
  f.otherwise(
      {"max_centre_sd_px", "NO-GO when the image centre is less certain, px", 1, above_zero},
      o.max_centre_sd_px);
  f.otherwise(
      {"max_focal_sd_percent", "NO-GO when the focal length is less certain, %", 1, above_zero},
      o.max_focal_sd_percent);
  f.otherwise({"outlier_sigmas",
               "reject dots farther off than this many robust standard deviations", 1, above_zero},
              o.outlier_sigmas);
  f.otherwise({"max_outliers_percent", "NO-GO when more dots are rejected, %", 1, 0},
              o.max_outliers_percent);
  f.otherwise({"max_iterations", "iterations of each refinement", 1, 1}, o.max_iterations);
  bool no_eccentricity = !o.correct_eccentricity;
  f.otherwise({"no_eccentricity", "take the centroid of a dot's image for the image of its centre"},
              no_eccentricity);
  o.correct_eccentricity = !no_eccentricity;
}

bool CalibReport::good() const {
  return std::all_of(cameras.begin(), cameras.end(),
                     [](const CameraReport& camera) { return camera.good(); });
}

CalibResult calibrate_tsai(const Detections& detections, const Rig& rig, const Target& target,
                           const CalibOptions& options) {
  check_record(options);
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
