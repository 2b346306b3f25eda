// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/joint.hpp"

namespace drape::calib {

/// Throws Error(bad_input) naming the camera if all its views lie in one corner of the image.
void check_places(const JointModel& views);

/// Throws Error(bad_input), naming the camera and a remedy, if the views of a started model cannot
/// calibrate an unknown lens: a single view, parallel planes, too little tilt. Adds duplicate views
/// to `warnings`.
void check_views(const JointModel& started, bool lens_known, std::vector<std::string>& warnings);

/// Largest angle (deg) between the target's normal and the optical axis over a camera's views.
[[nodiscard]] double largest_tilt_deg(const JointModel& model, std::size_t camera);

/// Percentage of the image inside the box around a camera's points.
[[nodiscard]] double covered_percent(const JointModel& model, std::size_t camera);

/// Residuals of each view; those above twice the median are flagged.
[[nodiscard]] std::vector<ViewReport> view_reports(const JointModel& model);

/// Warns of pixels that the fit finds not square, and of a stretched print, each beyond 0.1 % and
/// three standard deviations. Returns the contradiction with square pixels stated in the rig, or
/// "".
[[nodiscard]] std::string judge_squares(const JointModel& model, const Calibration& calibration,
                                        JointReport& report);

/// Reason why the result must not be used, or "good". `gross` counts rejected points, out of
/// `measured`, that are farther off at the target than the RMS limit.
[[nodiscard]] std::string joint_status(const JointReport& report, bool converged,
                                       bool has_covariance, std::size_t gross, std::size_t measured,
                                       const CalibOptions& options);

}  // namespace drape::calib
