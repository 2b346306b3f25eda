// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "calib/checks/causes.hpp"
#include "calib/checks/one_more.hpp"

namespace drape::calib {

/// Pixels by the placement's turn (rad, in the world) and shift (mm), 2 rows a point.
[[nodiscard]] Eigen::MatrixXd by_placement(const JointModel& model, const JointFrame& frame);

/// A camera that sees the moving target later than the others.
struct TimeSkew {
  std::size_t camera = 0;
  double sets = 0, sd_sets = 0;  ///< lag, part of the time between two sets; negative: earlier
  double explained = 0;          ///< part of the weighted sum of squares
  double effect_px = 0;          ///< RMS on the moving target
};

/// Derivative by the lag of each camera but the first, whose time is that of the sets.
[[nodiscard]] MoreColumns lags_of(const JointModel& model);

/// The one camera whose lag leaves least of all lags that were found (generalised least squares).
[[nodiscard]] std::optional<TimeSkew> find_time_skew(const JointModel& model,
                                                     const MoreParameters& lags,
                                                     const Causes& causes);

/// The camera whose lag explains most.
[[nodiscard]] TimeSkew late_camera(const JointModel& model, const JointFit& fit);

/// By how much the lag differs on a path through the next sets alone: about what the path leaves
/// unsaid of the target's motion between two sets.
[[nodiscard]] double error_of_path(const JointModel& model, const JointFit& fit,
                                   const TimeSkew& skew);

}  // namespace drape::calib
