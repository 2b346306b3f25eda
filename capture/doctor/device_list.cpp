// SPDX-License-Identifier: Apache-2.0
#include "capture/doctor/device_list.hpp"

#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/program/child.hpp"

namespace drape::capture {

std::vector<FoundDevice> list_devices(const std::filesystem::path& host_program, bool sizes) {
  std::vector<std::string> words = {"--list"};
  if (sizes) words.emplace_back("--sizes");
  std::string output;
  const ChildEnd end = run_child(host_program, words, output);
  FoundDevices devices;
  try {
    if (end.exit_code == 0)
      throw_if_any(
          faults_of_reading(Document(Syntax::json, json_value(output)), walk_through(devices)));
    if (end.exit_code == 0) return devices.cameras;
  } catch (const Error&) {  // reported below
  }
  throw Error(ErrorKind::device, "the cameras cannot be listed", {.file = host_program.string()},
              "run it by hand with --list; build or install drape-camera-host if it is missing");
}

}  // namespace drape::capture
