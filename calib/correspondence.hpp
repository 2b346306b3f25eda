// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape {

/// A target point and where a camera saw it.
struct Correspondence {
  Eigen::Vector3d point_in_world;  ///< metres
  Eigen::Vector2d px;              ///< as measured
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  std::string set = {};
  MarkId dot = {};
};

/// Dots of all target stages that the camera saw, by stage, then dot. Throws Error(bad_input) with
/// camera and set when a stage is missing, the image size or the dot grid is not the rig's, or a
/// number is not finite.
[[nodiscard]] std::vector<Correspondence> stage_correspondences(const Detections& detections,
                                                                const Rig& rig,
                                                                const Target& target,
                                                                const std::string& camera);

/// Throws Error(bad_input) naming the camera when the points cannot calibrate it: fewer than 11
/// (Willson 1995), or all in one plane. Returns the number of different heights.
int check_correspondences(const std::vector<Correspondence>& points, const std::string& camera);

}  // namespace drape
