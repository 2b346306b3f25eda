// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/joint/fit.hpp"
#include "core/detections.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Homography from the target's plane (metres) to the image (px) by algebraic error on normalised
/// coordinates (Hartley 1997). nullopt for collinear or too few points.
[[nodiscard]] std::optional<Eigen::Matrix3d> homography_of(const std::vector<TargetPoint>& points);

/// Pose of the target as seen by one camera.
struct SeenTarget {
  CamFromTarget cam_from_target;
  bool from_behind = false;  ///< z of the target points away from the camera, or mirrored labels
};

/// The target's plane in a distortion-free camera.
[[nodiscard]] SeenTarget planar_pose(const Eigen::Matrix3d& homography, double focal_px,
                                     const Eigen::Vector2d& principal_px);

/// Views of one camera by frame of the model; nullopt for an unusable frame.
using SeenTargets = std::vector<std::optional<SeenTarget>>;

/// Points in a pinhole camera of focal length 1; those outside the lens model's range are dropped.
[[nodiscard]] std::vector<TargetPoint> without_lens(const CameraModel& camera,
                                                    std::vector<TargetPoint> points);

/// Lens and target poses of camera `index` from its own views only: homographies, one focal length
/// (Zhang 1998) or the known lens (`lens_known`), then robust least squares of everything with
/// distortion. A view whose points are mostly outliers is dropped and named in `dropped`. Throws
/// Error(bad_input) naming the camera if it has no usable view or its focal length cannot be found.
[[nodiscard]] SeenTargets solve_alone(JointModel& model, std::size_t index, bool lens_known,
                                      std::vector<std::string>& dropped,
                                      LensTerms lens = LensTerms::k1_k2);

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
  LensTerms lens = LensTerms::k1_k2;  ///< terms of each camera's own fit
};

/// Smallest deviation at which a view contradicts the others, relative to the target's image.
inline constexpr double contradicting_part = 0.15;

/// Sets initial cameras and placements: each camera alone (solve_alone), then the cameras relative
/// to each other by the majority of common views, chained if two never see the target together.
/// Removes views that contradict the majority. Returns a line for each, with set, camera and
/// reason, and for a camera confirmed by others to see the target from behind: through a target, or
/// the back of a two-sided one. Throws Error(bad_input) naming the camera if its focal length
/// cannot be found (parallel planes, one level view), all its labels are mirrored, or it shares no
/// view with the others.
std::vector<std::string> start_joint(JointModel& model, const StartOptions& options = {});

/// Removes placements without frames.
void drop_unseen_placements(JointModel& model);

}  // namespace drape::calib
