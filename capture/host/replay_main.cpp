// SPDX-License-Identifier: Apache-2.0
// drape-replay-host: a recording in place of a camera. Apart from drape-camera-host, so that a live
// camera does not wait for the image libraries when it is opened again.
#include "capture/host/serve.hpp"
#include "core/error.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

using namespace drape;
using namespace drape::capture;

int main(int argc, char** argv) {
  Command app(
      "Plays one camera of a recording in a process of its own. Started by drape capture and "
      "drape\n"
      "doctor for cameras with backend = \"replay\".\n",
      "drape-replay-host");
  CommonOptions common;
  add_common_options(app, common);
  int control = -1, memory = -1, limit_mb = 2048;
  app.add_option("--control", control, "inherited descriptor of the commands");
  app.add_option("--memory", memory, "inherited descriptor of the shared frames");
  app.add_option("--memory-limit-mb", limit_mb, "address space of this process, in MB");
  return run_program(app, argc, argv, common, [&] {
    if (control < 0 || memory < 0)
      throw usage_error("the descriptors are missing", "run drape capture instead");
    become_camera_host(limit_mb);
    serve_camera(Descriptor(control), Descriptor(memory), open_replay_camera);
    return 0;
  });
}
