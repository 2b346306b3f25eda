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

/// Linear clock model: host = reference_host + (device - reference_device) * (1 + drift).
struct ClockFit {
  std::int64_t reference_device_ns = 0;
  std::int64_t reference_host_ns = 0;
  double drift_ppm = 0;   ///< excess rate of the host's clock, in parts per million
  double residual_s = 0;  ///< weighted root mean square residual of the fit, seconds
  double bound_s = 0;     ///< half the shortest round trip, which bounds one reading's error
  /// Additional bound within `least_span_s` of the samples: effect of an unknown drift of up to
  /// `largest_ppm`, the assumed limit of a camera's oscillator; 0 once the drift is estimated.
  double drift_bound_s = 0;
  double span_s = 0;  ///< host time from the first to the last sample
  std::size_t samples = 0;
  bool drift_estimated = false;  ///< false if the span is too short; drift is then 0

  /// Bound on the error of the offset, whether the drift is known or not.
  [[nodiscard]] double offset_bound_s() const { return bound_s + drift_bound_s; }
  /// Host time of a device time, in seconds since `host_epoch_ns`.
  [[nodiscard]] double host_time_s(std::int64_t device_ns, std::int64_t host_epoch_ns) const;
};

struct ClockFitOptions {
  double least_span_s = 1.0;   ///< shorter spans do not determine the drift
  double largest_ppm = 500.0;  ///< a larger drift is taken for a jump of the clock
};

/// Weighted least-squares fit of the samples, with weights 1 / (half round trip)^2. nullopt if
/// there is no sample, if a round trip is negative, or if the drift exceeds `largest_ppm`: then the
/// clock jumped between two samples and no straight line describes it.
[[nodiscard]] std::optional<ClockFit> fit_clock(const std::vector<ClockSample>& samples,
                                                const ClockFitOptions& options);

/// Jump of the device's clock between two readings beyond what their round trips and a drift of
/// `largest_ppm` explain; nullopt if it may have run evenly. There are no false alarms: both
/// readings bound the clock on either side.
[[nodiscard]] std::optional<double> clock_jump_s(const ClockSample& before,
                                                 const ClockSample& after,
                                                 double largest_ppm = 500.0);

}  // namespace drape::capture
