// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <functional>

#include "calib/acceptance/acceptance.hpp"
#include "calib/joint.hpp"

namespace drape::calib {

[[nodiscard]] Target target_of_tests();

/// A bench of two or three cameras that is calibrated once. Everything follows from the seed.
struct Instrument {
  unsigned seed = 0;
  double noise_px = 0, common_part = 0;
  /// Ratio of simulated to stated errors: disturb() adds six shapes with mean square 1 each, which
  /// the points' covariances do not state.
  [[nodiscard]] double noise_ratio() const { return std::sqrt(1 + 6 * common_part * common_part); }
  JointModel truth;  ///< the true cameras
  Calibration calibration;
  Rig rig;
};

[[nodiscard]] Instrument instrument(unsigned seed);

/// Detections of the instrument: two stages, eight positions, five repeats and a ball. `fault` can
/// change the truth after the calibration.
[[nodiscard]] AcceptanceInput recorded(const Instrument& of,
                                       const std::function<void(JointModel&)>& fault);

[[nodiscard]] Acceptance accepted(const Instrument& made, const AcceptanceInput& input,
                                  const AcceptanceOptions& options = {});

inline void no_fault(JointModel&) {}

}  // namespace drape::calib
