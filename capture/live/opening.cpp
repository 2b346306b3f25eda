// SPDX-License-Identifier: Apache-2.0
#include "capture/live/opening.hpp"

#include <fmt/format.h>
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

/// A camera that is named twice, once by its serial number: the second host waits in vain for it.
std::optional<LiveFault> one_device_twice(const std::vector<Running>& cameras,
                                          const CamerasFile& file) {
  for (std::size_t a = 0; a < cameras.size(); ++a)
    for (std::size_t b = 0; b < cameras.size(); ++b) {
      const CameraAddress& other = file.cameras[b].address;
      if (a == b || !cameras[a].host->ready() || other.device.empty() ||
          other.backend == Backend::replay || other.backend != file.cameras[a].address.backend)
        continue;
      const CameraIdentity& is = cameras[a].host->identity();
      if (other.device != is.serial && other.device != is.address) continue;
      return LiveFault{
          file.cameras[b].name,
          fmt::format("cameras `{}` and `{}` of {} are the same device: serial number "
                      "{}, address {}",
                      file.cameras[std::min(a, b)].name, file.cameras[std::max(a, b)].name,
                      file.file.filename().string(), is.serial, is.address),
          "give each [[camera]] a device of its own"};
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
  // By then a host has listed the network and named two devices of one serial number itself.
  const auto listed = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  for (;;) {
    wait_for_hosts(cameras, 0.02);
    bool all = true;
    for (const Running& camera : cameras) camera.host->pump();
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const CameraHost& host = *cameras[c].host;
      all = all && host.ready();
      if (host.fault()) return LiveFault{file.cameras[c].name, *host.fault(), host.what_to_do()};
      if (!host.ready() && std::chrono::steady_clock::now() > until)
        return LiveFault{file.cameras[c].name, "it does not open",
                         "check cable and power of the camera"};
    }
    if (std::chrono::steady_clock::now() > listed)
      if (auto twice = one_device_twice(cameras, file)) return twice;
    if (all) return without_clock(cameras, file, method);
  }
}

}  // namespace drape::capture
