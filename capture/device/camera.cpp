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

std::vector<FoundDevice> find_devices() {
  std::vector<FoundDevice> found = find_aravis_devices();
  const std::vector<FoundDevice> more = find_v4l2_devices();
  found.insert(found.end(), more.begin(), more.end());
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.name < b.name; });
  return found;
}

}  // namespace drape::capture
