// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace drape::capture {

/// One reading of a device's clock between two readings of the host's clock. The device read its
/// clock somewhere in between, so half the round trip bounds the error (Cristian 1989).
struct ClockSample {
  std::int64_t host_before_ns = 0;
  std::int64_t device_ns = 0;
  std::int64_t host_after_ns = 0;
};

/// host time = reference_host + (device - reference_device) * (1 + drift).
struct ClockFit {
  std::int64_t reference_device_ns = 0;
  std::int64_t reference_host_ns = 0;
  double drift_ppm = 0;   ///< excess of the host's rate, in parts per million
  double residual_s = 0;  ///< root of the weighted mean square of the fit, seconds
  double bound_s = 0;     ///< half the shortest round trip, which bounds one reading's error
  /// Added to that within `least_span_s` of the samples: what an unknown drift up to `largest_ppm`
  /// makes of it, assumed to be the most of a camera's oscillator; 0 once the drift is estimated.
  double drift_bound_s = 0;
  double span_s = 0;  ///< host time between the first and the last sample
  std::size_t samples = 0;
  bool drift_estimated = false;  ///< false: too short a span, drift taken as 0

  /// The offset's error is below it, whether the drift is known or not.
  [[nodiscard]] double offset_bound_s() const { return bound_s + drift_bound_s; }
  /// Seconds on the host's clock since `host_epoch_ns`.
  [[nodiscard]] double host_time_s(std::int64_t device_ns, std::int64_t host_epoch_ns) const;
};

struct ClockFitOptions {
  double least_span_s = 1.0;   ///< shorter spans give no drift
  double largest_ppm = 500.0;  ///< a larger drift is a jump of the clock, not a drift
};

/// Weighted least squares over the samples, weights 1 / (half round trip)^2. Nothing when there is
/// no sample or one has a round trip below zero; nothing too when the drift exceeds `largest_ppm`,
/// because then the clock jumped between two samples and no line describes it.
[[nodiscard]] std::optional<ClockFit> fit_clock(const std::vector<ClockSample>& samples,
                                                const ClockFitOptions& options);

/// Jump of the device's clock between two readings, beyond what their round trips and a
/// drift of `largest_ppm` explain; nothing when it may have run on evenly. Never a false alarm:
/// both readings bound the clock on both sides.
[[nodiscard]] std::optional<double> clock_jump_s(const ClockSample& before,
                                                 const ClockSample& after,
                                                 double largest_ppm = 500.0);

}  // namespace drape::capture
