// SPDX-License-Identifier: Apache-2.0
#include "capture/live/running.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace drape::capture {

bool is_confirmed(const Running& r, const Arrival& a) {
  const bool reads = r.last_reading && !r.host->on_host_clock();
  return !reads || r.last_reading->host_before_ns > a.arrived_ns;
}

void rebase(Running& r, const HostFrame& frame, std::optional<double> frame_rate_hz) {
  if (r.newest < 0) return;
  r.base = r.newest + 1;
  if (!frame.device_ns || !r.newest_device_ns || !frame_rate_hz) return;
  const double passed_s = 1e-9 * static_cast<double>(*frame.device_ns - *r.newest_device_ns);
  const double frames = passed_s * *frame_rate_hz;
  if (frames > 1.5 && frames < 1e6) r.base = r.newest + std::llround(frames);
}

std::int64_t least_complete(const std::vector<Running>& cameras) {
  std::int64_t least = cameras.front().complete;
  for (const Running& r : cameras) least = std::min(least, r.complete);
  return least;
}

std::optional<std::vector<double>> newest_exposures_s(const std::vector<Running>& cameras,
                                                      std::int64_t epoch_ns) {
  std::vector<double> result;
  for (const Running& r : cameras) {
    if (!r.started || r.fresh || !r.newest_device_ns) return std::nullopt;
    if (r.host->on_host_clock()) {
      result.push_back(1e-9 * static_cast<double>(*r.newest_device_ns - epoch_ns));
      continue;
    }
    const auto clock = newest_clock(r.clocks);
    if (!clock) return std::nullopt;
    result.push_back(clock->host_time_s(*r.newest_device_ns, epoch_ns));
  }
  return result;
}

double until_next_s(const std::vector<Running>& cameras, std::int64_t now_ns) {
  double until_s = std::numeric_limits<double>::infinity();
  for (const Running& r : cameras)
    if (!r.started && r.begin_ns > now_ns)
      until_s = std::min(until_s, 1e-9 * static_cast<double>(r.begin_ns - now_ns));
  return until_s;
}

}  // namespace drape::capture
