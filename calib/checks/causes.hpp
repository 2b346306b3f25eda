// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/joint/fit.hpp"

namespace drape::calib {

/// Evidence in the views against a rigid bench with fixed cameras and Brown lenses.
struct Causes {
  std::string fatal;                  ///< why the result must not be used; empty otherwise
  std::vector<std::string> warnings;  ///< causes that increase its uncertainty, with the remedy
  std::vector<double> alone_px, together_px;  ///< RMS by camera with separate target poses
                                              ///< per view, and with one for all cameras
};

/// Tests the views of a fit, in the order of the rig's sets, for a camera that moved, cameras that
/// are not synchronised, and a lens too wide for its model. Each test compares with the scatter
/// between views, so that noise common to the points of one view raises no alarm. Effects below the
/// residuals of single cameras are ignored.
[[nodiscard]] Causes causes_of(const JointModel& model, const JointFit& fit);

}  // namespace drape::calib
