// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/joint/model.hpp"
#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Frames of the target in the rig's sets: z stages (known placements, world z up) and free poses.
/// Without stages the first set defines the world. Throws Error(bad_input) with camera and set for
/// another target or image size and for a number that is not finite; adds a line to `notes` for
/// each frame that is absent or unusable.
[[nodiscard]] JointModel joint_frames(const Detections& detections, const Rig& rig,
                                      const Target& target, std::vector<std::string>& notes);

/// Index of a point among the board's shifts.
[[nodiscard]] inline int place_of(const Target& target, MarkId dot) {
  return dot.row * target.cols + dot.col;
}

struct StartOptions {
  bool lens_known = false;  ///< the model's cameras already have their lenses
  double thickness_m =
      0;  ///< thickness of a two-sided target: depth of its back's points below z = 0
};

/// Smallest deviation of a view that contradicts the others, relative to the target's image.
inline constexpr double contradicting_part = 0.15;

/// Initial cameras and placements: each camera alone (solve_alone), then the cameras relative to
/// each other by the majority of common views, chained if two never see the target together.
/// Removes views that contradict the majority. Returns a line for each, with set, camera and
/// reason, and for a camera that sees the target from behind, if other cameras confirm it: through
/// a target, or the back of a two-sided one. Throws Error(bad_input) naming the camera if its focal
/// length cannot be found (parallel planes, one level view), all its labels are mirrored, or it
/// shares no view with the others.
std::vector<std::string> start_joint(JointModel& model, const StartOptions& options = {});

/// Stages of known height from which start_joint() removed most views, with their heights; empty if
/// there are none. Without these views a wrong height cannot be detected.
[[nodiscard]] std::string lost_stages(const JointModel& all, const JointModel& kept);

/// Removes placements without frames.
void drop_unseen_placements(JointModel& model);

}  // namespace drape::calib
