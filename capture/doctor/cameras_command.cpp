// SPDX-License-Identifier: Apache-2.0
// drape-capture cameras: lists the cameras that answer, with the lines for cameras.toml.
#include <fmt/format.h>

#include "capture/commands.hpp"
#include "capture/doctor/device_list.hpp"
#include "capture/host/camera_host.hpp"
#include "core/fields/records.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

namespace drape::capture {

namespace {

struct CamerasArguments {
  bool sizes = false;
};
void fields(Fields& f, CamerasArguments& a) {
  f.otherwise({"sizes", "open each briefly to read its image size"}, a.sizes);
}

}  // namespace

int cameras_command(int argc, char** argv) {
  const auto run = [](const CamerasArguments& given, const CommonOptions& common) {
    const auto devices = list_devices(camera_host_program(), given.sizes);
    if (common.json) {
      print_text(pretty(value_of(FoundDevices{devices})));
      return devices.empty() ? 1 : 0;
    }
    Ending ending;
    ending.go = !devices.empty();
    ending.verdict = ending.go ? fmt::format("{} camera(s) answer", devices.size())
                               : "no camera answers: check power, cable and network card";
    for (const auto& d : devices) {
      std::string line = fmt::format("{}, {} {}, {}", name_of(d.backend), d.identity.vendor,
                                     d.identity.model, d.identity.address);
      if (d.width_px && d.height_px) line += fmt::format(", {} x {} px", *d.width_px, *d.height_px);
      if (given.sizes && !d.why_not_asked.empty()) line += ", size not known: " + d.why_not_asked;
      ending.numbers.emplace_back(d.name, line);
    }
    ending.next_command = "drape doctor RIG";
    return finish(ending, common);
  };
  return run_command<CamerasArguments>(
      argc, argv, "drape-capture cameras",
      "Lists the cameras that answer: GigE Vision, USB3 Vision and V4L2. Takes about a second.\n"
      "`device` is what cameras.toml of a rig names.\n",
      run);
}

}  // namespace drape::capture
