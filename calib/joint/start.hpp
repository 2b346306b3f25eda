// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/joint/model.hpp"
#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Frames of the target in the rig's sets: the z stages (known placements, world z up) and the
/// free poses. Without stages the first set defines the world. Throws Error(bad_input) with camera
/// and set for another target, image size, a number that is not finite, and labels that are
/// mirrored; `notes` gets a line for each frame that is absent or too poor to use.
[[nodiscard]] JointModel joint_frames(const Detections& detections, const Rig& rig,
                                      const Target& target, std::vector<std::string>& notes);

/// Start values of cameras and placements from the views' homographies, by the majority of views
/// where they disagree. Throws Error(bad_input) naming camera and set: no focal length to be had
/// (parallel planes, one level view), mirrored labels, a camera that shares no view with the
/// others, labels of one view that contradict the other cameras (corner order).
void start_joint(JointModel& model);

}  // namespace drape::calib
