// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <malloc.h>

#include "console/console.hpp"
#include "core/files/json_file.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

using namespace drape;

int main(int argc, char** argv) {
  Command app(
      "Serves the bench as a page in the browser, on this machine only: cameras, calibration, "
      "drapes,\nhistory and the session's log. Ctrl-C ends it; what was stored stays.\n\n"
      "  drape bench rigs/bench1 --replay     the recorded sets of the example, without a camera\n"
      "  drape bench rigs/lab                 the cameras of cameras.toml, which stay open",
      "drape bench");
  console::ConsoleOptions options;
  CommonOptions common;
  app.add_option("RIG", options.rig, "folder of the rig, or its rig.toml")->required();
  app.add_flag("--replay", options.replay, "the recording's sets instead of cameras");
  app.add_option(
      "--recording", options.recording,
      "recording to replay (default: the rig's), or to record into (default: <out>/recording)");
  app.add_option("--out", options.out, "output folder (default: out/<rig name>)");
  app.add_option("--port", options.port, "port; 0: any free one")
      ->range(0, 65535)
      ->capture_default_str();
  app.add_option("--address", options.address,
                 "address to listen on; another than this machine's own opens the bench to whoever "
                 "has the token")
      ->capture_default_str();
  add_common_options(app, common);
  return run_program(app, argc, argv, common, [&] {
    // Some 50 threads answer in turn, and each arena of memory keeps room for its largest answer.
    ::mallopt(M_ARENA_MAX, 2);
    console::Console bench(options);
    if (common.json) {
      print_text(pretty(Json{{"address", bench.address()}}));
    } else {
      print_text(
          fmt::format("open {}\nCtrl-C ends it; everything stored stays\n", bench.address()));
    }
    bench.serve();
    return 0;
  });
}
