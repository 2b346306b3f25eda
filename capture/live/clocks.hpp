// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "capture/live/live_capture.hpp"

namespace drape::capture {

/// Readings of one clock of a camera. One that was opened again, or whose clock jumped, has
/// several.
using ClockReadings = std::vector<std::vector<ClockSample>>;

[[nodiscard]] std::vector<std::optional<ClockFit>> fit_clocks(const ClockReadings& clocks);
[[nodiscard]] std::optional<ClockFit> newest_clock(const ClockReadings& clocks);

/// Cameras that say PTP holds their clocks, and whose clocks nevertheless differ by more than the
/// readings of both can explain (one in TAI and one in UTC, two masters, ...); and cameras whose
/// clocks PTP was asked to hold and does not, so that their offset and drift are estimated.
[[nodiscard]] std::vector<LiveFault> ptp_faults(const std::vector<LiveCameraReport>& cameras);

}  // namespace drape::capture
