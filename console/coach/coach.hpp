// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/detections.hpp"
#include "core/geometry/next_pose.hpp"

namespace drape::console {

/// The target measured in space with a given calibration, without using its known shape, and then
/// fitted by its drawing. On a set that the calibration did not use, `rms_m` is the error of a
/// measured point.
struct MeasuredTarget {
  WorldFromTarget world_from_target;
  int points = 0;    ///< points seen by two or more cameras
  double rms_m = 0;  ///< root mean square distance of the measured points from the drawing
  std::vector<Eigen::Vector3d> points_in_world;
};

/// Measures the target in space; nullopt if two cameras see fewer than 8 points.
[[nodiscard]] std::optional<MeasuredTarget> measure_target(
    const Calibration& calibration, const Target& target,
    const std::vector<FrameDetections>& frames);

}  // namespace drape::console
