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
/// and set for another target, image size and a number that is not finite; `notes` gets a line for
/// each frame that is absent or too poor to use.
[[nodiscard]] JointModel joint_frames(const Detections& detections, const Rig& rig,
                                      const Target& target, std::vector<std::string>& notes);

/// Index of a point among the board's shifts.
[[nodiscard]] inline int place_of(const Target& target, MarkId dot) {
  return dot.row * target.cols + dot.col;
}

struct StartOptions {
  bool lens_known = false;  ///< the model's cameras have their lenses already
  double thickness_m =
      0;  ///< thickness of a two-sided target: its back's points lie so far below z = 0
};

/// A view contradicts the others when it lies off by this part of the target's own image or more.
inline constexpr double contradicting_part = 0.15;

/// Start values of cameras and placements: each camera by itself (solve_alone), the cameras against
/// each other by the majority of the views they have in common, chained where two never see the
/// target together. Views that contradict the majority are taken out of the model; returns a line
/// for each, with set, camera and reason, and for a camera that sees the target from behind, where
/// other cameras confirm it: through a target, or the back of a two-sided one. Throws
/// Error(bad_input) naming the camera: no focal length to be had (parallel planes, one level view),
/// all its labels mirrored, no view in common with the others.
std::vector<std::string> start_joint(JointModel& model, const StartOptions& options = {});

/// The stages of known height that start_joint() took most views of, by their heights: empty when
/// there is none. Without them nothing shows that a height is wrong.
[[nodiscard]] std::string lost_stages(const JointModel& all, const JointModel& kept);

/// Takes out the placements that no frame shows.
void drop_unseen_placements(JointModel& model);

}  // namespace drape::calib
