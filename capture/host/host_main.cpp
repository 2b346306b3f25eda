// SPDX-License-Identifier: Apache-2.0
// drape-camera-host: one camera in its own process, so that a fault of the camera, its library or
// its network cannot end the capture.
#include "capture/host/serve.hpp"
#include "core/fields/records.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

using namespace drape;
using namespace drape::capture;

namespace {

struct HostArguments {
  bool listing = false, sizes = false;
  int control = -1, memory = -1, limit_mb = 2048;
};
void fields(Fields& f, HostArguments& a) {
  f.otherwise({"list", "print the cameras that answer as JSON and exit"}, a.listing);
  f.otherwise({"sizes", "with --list: open each to read its image size"}, a.sizes);
  f.otherwise({"control", "inherited descriptor of the commands"}, a.control);
  f.otherwise({"memory", "inherited descriptor of the shared frames"}, a.memory);
  f.otherwise({"memory_limit_mb", "address space of this process, in MB"}, a.limit_mb);
}

int run(const HostArguments& given, const CommonOptions&) {
  become_camera_host(given.limit_mb);
  if (given.listing || given.control < 0 || given.memory < 0) {
    print_text(one_line(value_of(FoundDevices{find_devices(given.sizes)})) + "\n");
    return 0;
  }
  serve_camera(Descriptor(given.control), Descriptor(given.memory));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return run_command<HostArguments>(
      argc, argv, "drape-camera-host",
      "Runs one camera in a separate process. Started by drape capture, drape capture cameras "
      "and\n"
      "drape doctor; by itself it lists the cameras that answer:\n\n"
      "  drape-camera-host --list\n",
      run);
}
