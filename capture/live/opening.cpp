// SPDX-License-Identifier: Apache-2.0
#include "capture/live/opening.hpp"

#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace drape::capture {
namespace {

std::optional<LiveFault> without_clock(const std::vector<Running>& cameras, const CamerasFile& file,
                                       SyncMethod method) {
  const bool scheduled = method == SyncMethod::scheduled_action;
  const bool by_time = method == SyncMethod::free_run || method == SyncMethod::line_trigger;
  if (!scheduled && (!by_time || file.pair_by_arrival || cameras.size() == 1)) return std::nullopt;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (has_clock(cameras[c])) continue;
    return LiveFault{file.cameras[c].name,
                     scheduled ? "its clock cannot be read"
                               : "its clock cannot be read, so that its frames cannot be paired by "
                                 "time",
                     scheduled ? "use another sync method"
                               : "use software_trigger, or pair_by_arrival = true in [sync]"};
  }
  return std::nullopt;
}

}  // namespace

bool has_clock(const Running& camera) {
  return camera.host->on_host_clock() || fit_clock(camera.host->clock_samples(), {}).has_value();
}

void wait_for_hosts(const std::vector<Running>& cameras, double timeout_s) {
  if (std::any_of(cameras.begin(), cameras.end(),
                  [](const Running& r) { return r.host->has_frame(); }))
    return;
  std::vector<pollfd> descriptors;
  descriptors.reserve(cameras.size());
  for (const Running& r : cameras) descriptors.push_back({r.host->descriptor(), POLLIN, 0});
  ::poll(descriptors.data(), descriptors.size(), static_cast<int>(std::ceil(1e3 * timeout_s)));
}

std::optional<LiveFault> open_all(std::vector<Running>& cameras, const CamerasFile& file,
                                  SyncMethod method, double opening_s) {
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    CameraSettings settings = file.cameras[c].settings;
    settings.trigger = trigger_of(method);
    cameras[c].host->set_settings(settings);
    cameras[c].host->launch();
  }
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(opening_s);
  for (;;) {
    wait_for_hosts(cameras, 0.02);
    bool all = true;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      CameraHost& host = *cameras[c].host;
      host.pump();
      all = all && host.ready();
      if (host.fault()) return LiveFault{file.cameras[c].name, *host.fault(), host.what_to_do()};
      if (!host.ready() && std::chrono::steady_clock::now() > until)
        return LiveFault{file.cameras[c].name, "it does not open",
                         "check cable and power of the camera"};
    }
    if (all) return without_clock(cameras, file, method);
  }
}

}  // namespace drape::capture
