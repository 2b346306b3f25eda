// SPDX-License-Identifier: Apache-2.0
#include "capture/doctor/device_list.hpp"

#include <sys/wait.h>

#include <cstdio>
#include <memory>

#include "capture/host/channel.hpp"
#include "core/error.hpp"
#include "core/program/shell_word.hpp"

namespace drape::capture {

std::vector<FoundDevice> list_devices(const std::filesystem::path& host_program, bool sizes) {
  const std::string command = shell_word(host_program.string()) +
                              (sizes ? " --list --sizes" : " --list") + " 2>/dev/null </dev/null";
  FILE* pipe = ::popen(command.c_str(), "re");
  std::string output;
  char buffer[4096];
  while (pipe != nullptr) {
    const std::size_t got = std::fread(buffer, 1, sizeof buffer, pipe);
    if (got == 0) break;
    output.append(buffer, got);
  }
  const int status = pipe == nullptr ? -1 : ::pclose(pipe);
  const Json json = try_json(output);
  if (status != 0 || json.is_discarded())
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
