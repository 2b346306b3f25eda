// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// A target point and its image in one camera.
struct Correspondence {
  Eigen::Vector3d point_in_world;  ///< metres
  Eigen::Vector2d px;              ///< measured position
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  std::string set = {};
  MarkId dot = {};
};

/// W with W'W the inverse of the covariance.
[[nodiscard]] Eigen::Matrix2d whitener(const Eigen::Matrix2d& covariance_px2);

/// Throws Error(bad_input) if the detections are of a cloth or of another target.
void check_lattice(const Detections& detections, const Rig& rig, const Target& target);

/// Frame of a set and camera; null if there is none.
[[nodiscard]] const FrameDetections* find_frame(const Detections& detections,
                                                const std::string& set, const std::string& camera);

/// Throws Error(bad_input) with camera and set if the image size differs from the rig's, or a
/// position or covariance is not finite or not positive.
void check_frame(const FrameDetections& frame, const RigCamera& camera);
void check_detection(const Detection& detection, const FrameDetections& frame);

/// Dots seen by the camera on all target stages, ordered by stage, then dot. Throws
/// Error(bad_input) with camera and set if a stage is missing, image size or dot grid differ from
/// the rig's, or a number is not finite.
[[nodiscard]] std::vector<Correspondence> stage_correspondences(const Detections& detections,
                                                                const Rig& rig,
                                                                const Target& target,
                                                                const std::string& camera);

/// Throws Error(bad_input) naming the camera if its points cannot calibrate it: fewer than 11
/// (Willson 1995), collinear, or at nearly equal heights. Returns the number of different heights;
/// 1 is a single plane.
int check_correspondences(const std::vector<Correspondence>& points, const std::string& camera);

}  // namespace drape::calib
