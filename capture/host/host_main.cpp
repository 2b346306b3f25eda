// SPDX-License-Identifier: Apache-2.0
// drape-camera-host: one camera in a process of its own, so that a camera, its library or its
// network cannot take the capture down.
#include "capture/host/serve.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

using namespace drape;
using namespace drape::capture;

int main(int argc, char** argv) {
  Command app(
      "Runs one camera in a process of its own. Started by drape capture, drape capture cameras "
      "and\n"
      "drape doctor; by itself it lists the cameras that answer:\n\n"
      "  drape-camera-host --list\n",
      "drape-camera-host");
  CommonOptions common;
  add_common_options(app, common);
  int control = -1, memory = -1, limit_mb = 2048;
  bool listing = false, sizes = false;
  app.add_flag("--list", listing, "print the cameras that answer as JSON, and end");
  app.add_flag("--sizes", sizes, "with --list: open each and ask for the size of its pictures");
  app.add_option("--control", control, "inherited descriptor of the commands");
  app.add_option("--memory", memory, "inherited descriptor of the shared frames");
  app.add_option("--memory-limit-mb", limit_mb, "address space of this process, in MB");
  return run_program(app, argc, argv, common, [&] {
    become_camera_host(limit_mb);
    if (listing || control < 0 || memory < 0) {
      print_text(one_line(value_of(FoundDevices{find_devices(sizes)})) + "\n");
      return 0;
    }
    serve_camera(Descriptor(control), Descriptor(memory));
    return 0;
  });
}
