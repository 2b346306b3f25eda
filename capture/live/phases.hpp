// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace drape::capture {

/// Delay of each camera's exposure after that of camera 0, in s: between -period/2 and +period/2,
/// because free-running cameras of one rate keep the phase they began with and nothing else tells
/// their frames apart. `exposed_s` holds one exposure of each camera, any, on the common clock.
[[nodiscard]] std::vector<double> phases_s(const std::vector<double>& exposed_s, double period_s);

/// The part of the period that holds an exposure of every camera: the least spread of a set.
[[nodiscard]] double least_spread_s(const std::vector<double>& phases_s, double period_s);

/// When a camera that began at `began_ns` and exposes `phase_s` after camera 0 has to begin again
/// to expose with it: the first such time after `not_before_ns`. The delay between beginning and
/// exposing is taken to be that of the first time.
[[nodiscard]] std::int64_t begin_again_ns(std::int64_t began_ns, double phase_s, double period_s,
                                          std::int64_t not_before_ns);

/// A camera that has to begin again, and how much later than camera 0 it exposes now.
struct NewPhase {
  std::size_t camera = 0;
  double phase_s = 0;
};

/// Watches free-running cameras and says which of them never expose with the others.
class InStep {
 public:
  /// `window_s` is the largest spread of a set.
  InStep(double period_s, double window_s) : period_s_(period_s), window_s_(window_s) {}

  /// `exposed_s` as phases_s() takes it, absent while it is not known of every camera. A camera is
  /// named when it has been out of step for 1.2 s (so it is no clock that just jumped), at most
  /// ten times in all: cameras of different rates cannot be brought into step.
  [[nodiscard]] std::vector<NewPhase> look(const std::optional<std::vector<double>>& exposed_s,
                                           std::int64_t now_ns);

 private:
  double period_s_, window_s_;
  std::int64_t looked_ns_ = 0, out_of_step_since_ns_ = 0;
  int named_ = 0;
};

}  // namespace drape::capture
