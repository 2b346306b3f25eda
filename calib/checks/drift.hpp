// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/joint/uncertainty.hpp"
#include "core/calibration.hpp"

namespace drape::calib {

/// Drift of a camera between two calibrations, over the places where cloth may hang.
struct CameraDrift {
  std::string camera;
  double moved_px = 0;     ///< RMS distance between the images of one world point, old and new
  double expected_px = 0;  ///< RMS expected by the two stated covariances
  double p = 1;            ///< probability of as large a drift, were there none
  [[nodiscard]] bool drifted() const { return p < 1e-3; }
};

struct Drift {
  std::vector<CameraDrift> cameras;     ///< by name, those that both calibrations have
  double moved_mm = 0;                  ///< RMS, of a point measured by all cameras
  double expected_mm = 0;               ///< by the two covariances
  std::vector<std::string> not_in_old;  ///< cameras
};

/// Compares two calibrations over `points` (metres, in the world of `now`). The two worlds are laid
/// onto each other first, since each rests on its own placement of the target; what stays is how
/// lenses and cameras moved against each other. Throws Error(bad_input) when no camera is common.
[[nodiscard]] Drift drift_between(const Calibration& old, const Calibration& now,
                                  const std::vector<Eigen::Vector3d>& points);

}  // namespace drape::calib
