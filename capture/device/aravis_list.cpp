// SPDX-License-Identifier: Apache-2.0
// The cameras that Aravis sees, and those it hides because another one has the same serial number.
#include <arv.h>
#include <fmt/format.h>

#include <algorithm>

#include "capture/device/aravis_features.hpp"
#include "capture/device/camera.hpp"
#include "capture/device/gige_discovery.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

void add_hidden(std::vector<FoundDevice>& found) {
  for (const GigeAnswer& answer : gige_cameras()) {
    const auto has_serial = [&](const FoundDevice& d) {
      return d.identity.serial == answer.serial;
    };
    const auto is_listed = [&](const FoundDevice& d) {
      return has_serial(d) && d.identity.address == answer.address;
    };
    const auto twin = std::find_if(found.begin(), found.end(), has_serial);
    if (twin == found.end() || std::any_of(found.begin(), found.end(), is_listed)) continue;
    FoundDevice other = *twin;
    other.identity.address = answer.address;
    found.push_back(std::move(other));
  }
}

}  // namespace

void refuse_duplicate_serial(const std::string& device) {
  std::string addresses;
  int found = 0;
  for (const GigeAnswer& answer : gige_cameras()) {
    if (answer.serial != device) continue;
    addresses += (found++ == 0 ? "" : ", ") + answer.address;
  }
  if (found < 2) return;
  throw device_error(fmt::format("{} cameras have this serial number: {}", found, addresses),
                     device, "name the camera by its IP address, with host_address");
}

std::vector<FoundDevice> find_aravis_devices() {
  arv_update_device_list();
  std::vector<FoundDevice> found;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    FoundDevice device;
    device.identity.vendor = text_of(arv_get_device_vendor(i));
    device.identity.model = text_of(arv_get_device_model(i));
    device.identity.serial = text_of(arv_get_device_serial_nbr(i));
    device.identity.address = text_of(arv_get_device_address(i));
    device.name = device.identity.serial;
    found.push_back(std::move(device));
  }
  add_hidden(found);
  return found;
}

}  // namespace drape::capture
