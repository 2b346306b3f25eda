// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "core/camera_model.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/rig.hpp"
#include "detect/prints/layout.hpp"

namespace drape::test {

using namespace detect;

/// Directions in the camera frame of the rays through the upper left corners of a camera's pixels,
/// row by row, one more than pixels along u and v. They are the same for all its pictures.
std::vector<Eigen::Vector3d> corner_rays(const Camera& camera);

/// A camera's view of a target as drawn by `drape print`: unbounded light paper, dark marks,
/// blurred by 0.6 px, with noise of 1.5 grey levels. The light of a pixel is the mean of 64 points
/// where an edge crosses it, along rays through the camera's own lens.
cv::Mat picture_of(const PrintedPage& printed, const Camera& camera,
                   const std::vector<Eigen::Vector3d>& rays,
                   const WorldFromTarget& world_from_target, unsigned seed);

}  // namespace drape::test
