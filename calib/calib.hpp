// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/checks/inputs.hpp"
#include "calib/tsai/tsai.hpp"
#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/fields/fields.hpp"
#include "core/rig.hpp"

namespace drape::calib {

struct CalibOptions {
  /// Verdict: largest RMS distance of the target's points from their rays; a tenth of the virtual
  /// cloth's default spacing.
  double max_rms_mm = 0.25;
  double max_centre_sd_percent = 1;  ///< verdict: above, the image centre is undetermined
  double max_focal_sd_percent = 2;   ///< verdict: above, focal length and distance are undetermined
  bool correct_eccentricity = true;  ///< eccentricity of the dots' images (Heikkila 2000)
  double outlier_sigmas = 6;  ///< dots with larger residuals (robust sigma) are rejected by name
  double max_outliers_percent = 3;  ///< a camera with more rejected dots fails
  int max_iterations = 200;
};
void fields(Fields& f, CalibOptions& options);

/// Why a calibration of `measured` points is NO-GO whose `gross` rejected ones lie farther off at
/// the target than the RMS limit; empty if they are few. Both methods judge by it.
[[nodiscard]] std::string too_many_gross(std::size_t gross, std::size_t measured,
                                         const CalibOptions& options);

/// One stage of Tsai's method for one camera.
struct TsaiStep {
  double focal_mm = 0;
  double rms_px = 0;  ///< point distance in the distorted image
};

struct CameraReport {
  std::string camera;
  std::string status;  ///< "good", or why the camera's result must not be used
  int points = 0;
  int planes = 0;               ///< number of heights of the target
  bool origin_shifted = false;  ///< true if Ty was too close to 0 for stage 1
  double stage1_ty_mm = 0;
  double stage1_scale_x = 1;  ///< Tsai's s_x from stage 1, a check if it is fixed at 1
  TsaiStep basic;             ///< after stage 2, for information only: f and Tz cannot be separated
  TsaiStep full;              ///< after stage 3
  ClassicalErrors errors;     ///< errors after the full optimisation
  int iterations = 0;
  double max_eccentricity_px = 0;  ///< largest correction of a dot centre
  double focal_sd_mm = 0;
  double centre_sd_px = 0;            ///< larger of the two coordinates of the image centre
  double object_rms_mm = 0;           ///< distance of the target's points from their rays
  double chi2_per_dof = 0;            ///< relative to the marks' covariances
  std::optional<StageCheck> stages;   ///< motion of the target on its z stage
  std::vector<std::string> notes;     ///< limitations of these data
  std::vector<std::string> rejected;  ///< unused dots, with set, index and reason

  [[nodiscard]] bool good() const { return status == "good"; }
};

struct CalibReport {
  std::vector<CameraReport> cameras;  ///< in the order of the rig
  [[nodiscard]] bool good() const;
};

struct CalibResult {
  Calibration calibration;
  CalibReport report;
};

/// Calibrates each camera of the rig with Tsai's method (Tsai 1987; paper section 5): for points at
/// several heights (non-coplanar), or on one plane if the rig has a single stage (coplanar). Radial
/// alignment, then f, Tz and kappa1, then all parameters together on distorted pixels. World: the
/// target in its reference pose, so a dot of the stage at height z is (x, y, z). Throws
/// Error(bad_input) with camera and set if the data cannot calibrate: a missing stage or camera,
/// too few points, one plane parallel to the image, mirrored points, values that are not finite. A
/// fit that does not converge or is ill-conditioned is a status in the Report.
[[nodiscard]] CalibResult calibrate_tsai(const Detections& detections, const Rig& rig,
                                         const Target& target, const CalibOptions& options);

}  // namespace drape::calib
