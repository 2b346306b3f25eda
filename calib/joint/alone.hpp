// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/joint/fit.hpp"

namespace drape::calib {

/// The target as one camera sees it.
struct SeenTarget {
  CamFromTarget cam_from_target;
  bool from_behind = false;  ///< its z points away from the camera, or its labels are mirrored
};

/// Views of one camera by frame of the model; nothing for a frame that is not usable.
using SeenTargets = std::vector<std::optional<SeenTarget>>;

/// Points where a pinhole camera of focal length 1 would see them; none beyond the lens's model.
[[nodiscard]] std::vector<TargetPoint> without_lens(const CameraModel& camera,
                                                    std::vector<TargetPoint> points);

/// Lens and target poses of camera `index` from its own views: homographies, one focal length
/// (Zhang 1998) or the lens it already has (`lens_known`), then all by robust least squares with
/// distortion. A view most of whose points lie off is left out; `dropped` names it. Throws
/// Error(bad_input) naming the camera when it has no usable view or no focal length can be had.
[[nodiscard]] SeenTargets solve_alone(JointModel& model, std::size_t index, bool lens_known,
                                      std::vector<std::string>& dropped,
                                      LensTerms lens = LensTerms::k1_k2);

}  // namespace drape::calib
