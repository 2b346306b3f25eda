// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "core/camera_model.hpp"
#include "core/pose.hpp"
#include "core/rig.hpp"
#include "detect/print_layout.hpp"

namespace drape::test {

/// What a camera sees of a target as `drape print` draws it: light paper without end, dark marks,
/// blurred by 0.6 px, with noise of 1.5 grey levels. The light of a pixel is the mean of 64 points
/// where an edge crosses it, along rays of the camera's own lens.
cv::Mat picture_of(const Target& target, const PrintedPage& printed, const Camera& camera,
                   const WorldFromTarget& world_from_target, unsigned seed);

}  // namespace drape::test
