// SPDX-License-Identifier: Apache-2.0
#include "capture/device/camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace drape {

std::string to_string(Backend backend) {
  switch (backend) {
    case Backend::aravis:
      return "aravis";
    case Backend::v4l2:
      return "v4l2";
    case Backend::replay:
      return "replay";
  }
  return {};
}

std::string to_string(TriggerSource source) {
  switch (source) {
    case TriggerSource::free_run:
      return "free_run";
    case TriggerSource::software:
      return "software";
    case TriggerSource::line:
      return "line";
    case TriggerSource::action:
      return "action";
  }
  return {};
}

std::unique_ptr<Camera> open_camera(const CameraAddress& address) {
  switch (address.backend) {
    case Backend::aravis:
      return open_aravis_camera(address);
    case Backend::v4l2:
      return open_v4l2_camera(address);
    case Backend::replay:
      return open_replay_camera(address);
  }
  throw internal_error("unknown camera backend");
}

std::vector<FoundDevice> find_devices() {
  std::vector<FoundDevice> found = find_aravis_devices();
  const std::vector<FoundDevice> more = find_v4l2_devices();
  found.insert(found.end(), more.begin(), more.end());
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.name < b.name; });
  return found;
}

Error device_error(std::string what_failed, const std::string& device, std::string what_to_do) {
  return Error(ErrorKind::device, std::move(what_failed), {.field = "device " + device},
               std::move(what_to_do));
}

void require_taken(const std::string& name, double asked, double got, const std::string& device) {
  constexpr double tolerance = 0.02;
  if (std::abs(got - asked) <= tolerance * std::max(std::abs(asked), 1e-9)) return;
  throw device_error(fmt::format("the camera took {} {:g} instead of {:g}", name, got, asked),
                     device, "give a value the camera can take, within its range and steps");
}

}  // namespace drape
