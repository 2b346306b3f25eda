// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/detections.hpp"
#include "core/rig.hpp"
#include "detect/targets/corner_point.hpp"

namespace drape::detect {

/// Gives each corner of a frame the operator's covariance, scaled so that the frame's mean variance
/// is what its corners scatter by along the target's lines. Corners whose own directions disagree
/// more have a larger chi-square. `points` belong to `frame.detections`, one each.
void set_corner_covariances(const Target& target, const std::vector<CornerPoint>& points,
                            FrameDetections& frame);

}  // namespace drape::detect
