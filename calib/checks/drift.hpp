// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/joint/uncertainty.hpp"
#include "core/calibration.hpp"

namespace drape::calib {

/// Drift of a camera between two calibrations, evaluated in the volume of the cloth.
struct CameraDrift {
  std::string camera;
  double moved_px = 0;     ///< RMS distance between the old and new image of a world point
  double expected_px = 0;  ///< RMS expected from the two stated covariances
  double p = 1;            ///< probability of such a drift by chance
  [[nodiscard]] bool drifted() const { return p < 1e-3; }
};

struct Drift {
  std::vector<CameraDrift> cameras;     ///< cameras in both calibrations, by name
  double moved_mm = 0;                  ///< RMS displacement of a point measured by all cameras
  double expected_mm = 0;               ///< expected from the two covariances
  std::vector<std::string> not_in_old;  ///< names of new cameras
};

/// Compares two calibrations at `points` (metres, in the world of `now`). The worlds are aligned
/// first, since each depends on its own placement of the target; what remains is relative motion of
/// lenses and cameras. Throws Error(bad_input) if they have no common camera.
[[nodiscard]] Drift drift_between(const Calibration& old, const Calibration& now,
                                  const std::vector<Eigen::Vector3d>& points);

}  // namespace drape::calib
