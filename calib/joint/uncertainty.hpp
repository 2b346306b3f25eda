// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/joint/model.hpp"
#include "core/geometry/next_pose.hpp"

namespace drape::calib {

/// Region in which cloth may hang: over the target, up to its highest stage.
[[nodiscard]] WorldBox drape_volume(const JointModel& model);

/// Standard deviation (px, of one coordinate) that the calibration alone gives the image of a world
/// point; nothing where the point does not project or the camera has no covariance.
[[nodiscard]] std::optional<double> projected_sd_px(const CalibratedCamera& camera,
                                                    const Eigen::Vector3d& point_in_world);

/// Covariance (mm^2) that the calibration alone gives a point measured by all cameras, from the
/// joint covariance: the triangulated point moves with the cameras (first order, equal weights).
/// Nothing when fewer than two cameras see the point or there is no joint covariance.
[[nodiscard]] std::optional<Eigen::Matrix3d> point_covariance_mm2(
    const Calibration& calibration, const Eigen::Vector3d& point_in_world);

/// Root mean square over the grid of the standard deviation (mm, all three axes together).
[[nodiscard]] std::optional<double> volume_sd_mm(const Calibration& calibration,
                                                 const std::vector<Eigen::Vector3d>& points);

}  // namespace drape::calib
