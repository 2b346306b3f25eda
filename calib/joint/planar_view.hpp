// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/joint/model.hpp"
#include "core/pose.hpp"

namespace drape::calib {

/// Homography from the target's plane (metres) to the image (px) by algebraic error on normalised
/// coordinates (Hartley 1997). nullopt for collinear or too few points.
[[nodiscard]] std::optional<Eigen::Matrix3d> homography_of(const std::vector<TargetPoint>& points);

/// Common focal length (px) of views of a plane, for a given principal point, from the
/// orthogonality and equal length of the plane's axes (Zhang 1998). nullopt if no view is tilted
/// enough for its vanishing points to determine a focal length.
[[nodiscard]] std::optional<double> focal_px_of(const std::vector<Eigen::Matrix3d>& homographies,
                                                const Eigen::Vector2d& principal_px);

/// Pose of the plane in a distortion-free camera. If z of the target points away from the camera,
/// the labels are mirrored (or the target is seen from behind).
struct PlanarPose {
  CamFromTarget cam_from_target;
  bool mirrored = false;
};
[[nodiscard]] PlanarPose planar_pose(const Eigen::Matrix3d& homography, double focal_px,
                                     const Eigen::Vector2d& principal_px);

}  // namespace drape::calib
