// SPDX-License-Identifier: Apache-2.0
#include "capture/doctor/device_list.hpp"

#include "capture/host/channel.hpp"
#include "core/error.hpp"
#include "core/program/child.hpp"

namespace drape::capture {

std::vector<FoundDevice> list_devices(const std::filesystem::path& host_program, bool sizes) {
  std::vector<std::string> words = {"--list"};
  if (sizes) words.emplace_back("--sizes");
  std::string output;
  const ChildEnd end = run_child(host_program, words, output);
  const Json json = try_json(output);
  if (end.exit_code != 0 || json.is_discarded())
    throw Error(ErrorKind::device, "the cameras cannot be listed", {.file = host_program.string()},
                "run it by hand with --list; build or install drape-camera-host if it is missing");
  std::vector<FoundDevice> devices;
  for (const Json& item : json) {
    FoundDevice device;
    device.backend = item.at("backend") == "v4l2" ? Backend::v4l2 : Backend::aravis;
    device.name = item.at("name");
    device.identity = identity_of(item.at("identity"));
    if (!item.at("width_px").is_null()) device.width_px = item.at("width_px").get<int>();
    if (!item.at("height_px").is_null()) device.height_px = item.at("height_px").get<int>();
    device.why_not_asked = item.at("why_not_asked");
    devices.push_back(device);
  }
  return devices;
}

}  // namespace drape::capture
