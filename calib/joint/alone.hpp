// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/joint/fit.hpp"

namespace drape::calib {

/// Pose of the target as seen by one camera.
struct SeenTarget {
  CamFromTarget cam_from_target;
  bool from_behind = false;  ///< z of the target points away from the camera, or mirrored labels
};

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

}  // namespace drape::calib
