// SPDX-License-Identifier: Apache-2.0
#include "capture/device/camera.hpp"

#include <algorithm>

namespace drape::capture {

extern const CameraDriver aravis_driver, v4l2_driver, replay_driver;

/// Indexed by Backend.
static constexpr const CameraDriver* kDrivers[] = {&aravis_driver, &v4l2_driver, &replay_driver};

namespace {

void ask_size(FoundDevice& device) {
  const bool network = device.backend == Backend::aravis && !device.identity.address.empty();
  try {
    const auto camera =
        open_camera({device.backend, network ? device.identity.address : device.name, "", ""});
    const auto settings = camera->configure({});
    if (const auto px = setting_in(settings, "width_px")) device.width_px = std::stoi(*px);
    if (const auto px = setting_in(settings, "height_px")) device.height_px = std::stoi(*px);
    device.identity.host_address = camera->identity().host_address;
  } catch (const Error& error) {
    device.why_not_asked = error.what_failed();
  }
}

}  // namespace

std::unique_ptr<CameraDevice> open_camera(const CameraAddress& address) {
  return kDrivers[static_cast<std::size_t>(address.backend)]->open(address);
}

std::vector<FoundDevice> find_devices(bool sizes) {
  std::vector<FoundDevice> found;
  for (std::size_t backend = 0; backend < std::size(kDrivers); ++backend) {
    if (kDrivers[backend]->find == nullptr) continue;
    for (FoundDevice& device : kDrivers[backend]->find()) {
      device.backend = static_cast<Backend>(backend);
      found.push_back(std::move(device));
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.name < b.name; });
  if (sizes) std::for_each(found.begin(), found.end(), ask_size);
  return found;
}

}  // namespace drape::capture
