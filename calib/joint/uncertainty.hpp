// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/joint/model.hpp"
#include "core/geometry/next_pose.hpp"

namespace drape::calib {

/// Region in which cloth may hang: above the target, up to its highest stage.
[[nodiscard]] WorldBox drape_volume(const JointModel& model);

/// Standard deviation (px, one coordinate) of a world point's image due to the calibration alone;
/// nullopt if the point does not project or the camera has no covariance.
[[nodiscard]] std::optional<double> projected_sd_px(const CalibratedCamera& camera,
                                                    const Eigen::Vector3d& point_in_world);

/// Covariance (mm^2) of a point measured by all cameras due to the calibration alone, from the
/// joint covariance (first order, equal weights). nullopt if fewer than two cameras see the point
/// or there is no joint covariance.
[[nodiscard]] std::optional<Eigen::Matrix3d> point_covariance_mm2(
    const Calibration& calibration, const Eigen::Vector3d& point_in_world);

/// Root mean square over a grid of the standard deviation (mm, all three axes together).
[[nodiscard]] std::optional<double> volume_sd_mm(const Calibration& calibration,
                                                 const std::vector<Eigen::Vector3d>& points);

}  // namespace drape::calib
