// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/joint.hpp"

namespace drape::calib {

/// Throws Error(bad_input) naming the camera when all its views lie in one corner of the image.
void check_places(const JointModel& views);

/// Throws Error(bad_input), naming the camera and the next action, when the views of a started
/// model cannot calibrate a lens that is not known: one view only, parallel planes, too little
/// tilt. Warns of duplicate views in `warnings`.
void check_views(const JointModel& started, bool lens_known, std::vector<std::string>& warnings);

/// Largest angle (deg) between the target's normal and the optical axis over a camera's views.
[[nodiscard]] double largest_tilt_deg(const JointModel& model, std::size_t camera);

/// Part of the image (percent) that the box around a camera's points covers.
[[nodiscard]] double covered_percent(const JointModel& model, std::size_t camera);

/// Residuals of each view; those above twice the median are marked.
[[nodiscard]] std::vector<ViewReport> view_reports(const JointModel& model);

/// Warns of pixels that are not square by the fit, and of a stretched print, each by more than 0.1
/// % and three standard deviations. Returns the contradiction with square pixels that the rig
/// promises, or "".
[[nodiscard]] std::string judge_squares(const JointModel& model, const Calibration& calibration,
                                        JointReport& report);

/// Why the result must not be used, or "good". `gross`: points rejected that are farther off at the
/// target than the limit of the RMS, of `measured` points.
[[nodiscard]] std::string joint_status(const JointReport& report, bool converged,
                                       bool has_covariance, std::size_t gross, std::size_t measured,
                                       const CalibOptions& options);

}  // namespace drape::calib
