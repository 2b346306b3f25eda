// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace drape::capture {

/// Delay of each camera's exposure after that of camera 0, in s, between -period/2 and +period/2.
/// Free-running cameras of one rate keep their initial phase, and nothing else distinguishes their
/// frames. `exposed_s` holds any one exposure of each camera on the common clock.
[[nodiscard]] std::vector<double> phases_s(const std::vector<double>& exposed_s, double period_s);

/// Shortest interval that contains one exposure of every camera: the smallest spread of a set.
[[nodiscard]] double least_spread_s(const std::vector<double>& phases_s, double period_s);

/// Restart time of a camera that was started at `began_ns` and exposes `phase_s` after camera 0, so
/// that both expose together: the first such time after `not_before_ns`. Assumes that the delay
/// from start to exposure stays the same.
[[nodiscard]] std::int64_t begin_again_ns(std::int64_t began_ns, double phase_s, double period_s,
                                          std::int64_t not_before_ns);

/// A camera that must be restarted, with the delay of its exposure after camera 0.
struct NewPhase {
  std::size_t camera = 0;
  double phase_s = 0;
};

/// Monitors free-running cameras and finds those that never expose with the others.
class InStep {
 public:
  /// `window_s` is the largest spread of a set.
  InStep(double period_s, double window_s) : period_s_(period_s), window_s_(window_s) {}

  /// Takes `exposed_s` as phases_s() does, absent while a camera's is unknown. A camera is reported
  /// once it has been out of step for 1.2 s (which excludes a clock that just jumped), at most ten
  /// times in all: cameras of different rates cannot be brought into step.
  [[nodiscard]] std::vector<NewPhase> look(const std::optional<std::vector<double>>& exposed_s,
                                           std::int64_t now_ns);

 private:
  double period_s_, window_s_;
  std::int64_t looked_ns_ = 0, out_of_step_since_ns_ = 0;
  int named_ = 0;
};

}  // namespace drape::capture
