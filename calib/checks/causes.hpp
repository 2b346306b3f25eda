// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/joint/fit.hpp"

namespace drape::calib {

/// Evidence of the views against one rigid bench with still cameras and lenses of Brown's model.
struct Causes {
  std::string fatal;                  ///< why the result must not be used; empty when nothing is
  std::vector<std::string> warnings;  ///< causes that widen its uncertainty, with the remedy
  std::vector<double> alone_px, together_px;  ///< RMS by camera: each view with its own pose, and
                                              ///< with the pose that all cameras give it
};

/// Tests the views of a fit, in the order of the rig's sets, for a camera that moved, cameras that
/// do not see the target at the same time, and a lens wider than its model. Each test rests on the
/// scatter between the views, so that noise common to a view's points raises no alarm; an effect
/// below the residuals of the cameras alone is no cause.
[[nodiscard]] Causes causes_of(const JointModel& model, const JointFit& fit);

}  // namespace drape::calib
