// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "capture/host/camera_host.hpp"
#include "capture/live/clocks.hpp"

namespace drape::capture {

/// A frame before the clocks are fitted.
struct Arrival {
  std::size_t camera = 0;
  std::int64_t index = 0;
  std::optional<std::size_t> clock;  ///< which of the camera's clocks stamped it, when that is sure
  std::optional<std::int64_t> counted_trigger;  ///< that it answers, where the camera has no clock
  std::optional<std::size_t> settled;           ///< number of the set it was given out in
  std::int64_t arrived_ns = 0;
  HostFrame frame;
  bool given_up = false;  ///< no partner came in time; it has no pixels
};

/// One camera of a capture that goes on.
struct Running {
  std::unique_ptr<CameraHost> host;
  FrameIdUnwrapper ids{FrameIdRange{}};
  std::int64_t base = 0;  ///< added to the unwrapped id; grows when ids start again
  std::int64_t newest = -1;
  std::optional<std::int64_t> newest_device_ns;
  std::int64_t last_frame_ns = 0;  ///< host time, for the watchdog only
  std::int64_t failed_ns = 0;      ///< 0: it runs
  std::int64_t retry_ns = 0;
  std::int64_t began_ns = 0;  ///< host time at which it was commanded to stream
  std::int64_t begin_ns = 0;  ///< not commanded to stream again before
  /// The first trigger since its last frame, and how many there were; of those of the session.
  std::int64_t asked_ns = 0;
  int unanswered = 0;
  bool started = false, fresh = true;
  double longest_gap_s = 0, longest_unnoticed_s = 0;
  /// Readings of the clock; a camera that was opened again, or whose clock jumped, has a new one.
  ClockReadings clocks;
  std::size_t clock_taken = 0;
  std::optional<ClockSample> last_reading;  ///< of the newest of `clocks`
  std::int64_t sure_from_ns = 0;  ///< frames that arrive before may be stamped by the clock before
  bool stamps_are_off = false;
  std::int64_t complete = 0;
  int opened_in_vain = 0;  ///< times since its last frame
  bool given_up = false;
  /// A frame and the trigger it answers, from which a camera without a clock is counted on.
  struct Counted {
    std::int64_t index = 0, trigger = 0;
  };
  std::optional<Counted> counted;
  int silent_triggers = 0;  ///< one after another
};

/// Has the camera's clock been read since the frame came? Then no jump that is seen later touches
/// it.
[[nodiscard]] bool is_confirmed(const Running& r, const Arrival& a);

/// After a restart the device counts from the start again. Frames missed meanwhile are counted by
/// its clock, when that ran on and the camera has a rate of its own.
void rebase(Running& r, const HostFrame& frame, std::optional<double> frame_rate_hz);

/// Whole frames of the camera that has the fewest.
[[nodiscard]] std::int64_t least_complete(const std::vector<Running>& cameras);

/// The newest exposure of each camera on the host's clock since `epoch_ns`; nothing while one is
/// not known.
[[nodiscard]] std::optional<std::vector<double>> newest_exposures_s(
    const std::vector<Running>& cameras, std::int64_t epoch_ns);

/// Until the next camera that waits for it is to begin.
[[nodiscard]] double until_next_s(const std::vector<Running>& cameras, std::int64_t now_ns);

}  // namespace drape::capture
