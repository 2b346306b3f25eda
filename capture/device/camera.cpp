// SPDX-License-Identifier: Apache-2.0
#include "capture/device/camera.hpp"

#include <algorithm>

#include "core/error.hpp"

namespace drape::capture {

std::unique_ptr<CameraDevice> open_camera(const CameraAddress& address) {
  switch (address.backend) {
    case Backend::aravis:
      return open_aravis_camera(address);
    case Backend::v4l2:
      return open_v4l2_camera(address);
    case Backend::replay:
      break;  // its host opens it
  }
  throw internal_error("unknown camera backend");
}

namespace {

void ask_size(FoundDevice& device) {
  const bool network = device.backend == Backend::aravis && !device.identity.address.empty();
  try {
    const auto camera =
        open_camera({device.backend, network ? device.identity.address : device.name, "", ""});
    for (const SettingReadBack& s : camera->configure({})) {
      if (s.name == "width_px") device.width_px = std::stoi(s.value);
      if (s.name == "height_px") device.height_px = std::stoi(s.value);
    }
    device.identity.host_address = camera->identity().host_address;
  } catch (const Error& error) {
    device.why_not_asked = error.what_failed();
  }
}

}  // namespace

std::vector<FoundDevice> find_devices(bool sizes) {
  std::vector<FoundDevice> found = find_aravis_devices();
  const std::vector<FoundDevice> more = find_v4l2_devices();
  found.insert(found.end(), more.begin(), more.end());
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.name < b.name; });
  if (sizes) std::for_each(found.begin(), found.end(), ask_size);
  return found;
}

}  // namespace drape::capture
