// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>

#include "core/calibration.hpp"
#include "core/detections.hpp"

namespace drape::calib {

/// A point of the target in space, with what its uncertainty comes from.
struct MeasuredPoint {
  Eigen::Vector3d in_world_mm;
  Eigen::Matrix3d noise_mm2;           ///< from the detections' covariances
  Eigen::Matrix3Xd by_calibration_mm;  ///< by the cameras' parameters, as in joint_covariance
};

/// All points of a set that two or more calibrated cameras saw (least squares on distorted pixels).
/// The parameters stand camera after camera in the order of the calibration.
[[nodiscard]] std::map<MarkId, MeasuredPoint> measured_points(const Detections& detections,
                                                              const Calibration& calibration,
                                                              const std::string& set);

}  // namespace drape::calib
