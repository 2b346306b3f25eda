// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>
#include <semaphore.h>
#include <signal.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <thread>

#include "console/console.hpp"
#include "core/fields/fields.hpp"
#include "core/files/json_file.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

using namespace drape;

namespace drape::console {

static void fields(Fields& f, ConsoleOptions& o) {
  f(Field{"rig", "folder of the rig, or its rig.toml"}.called("RIG"), o.rig);
  f.otherwise({"replay", "the recording's sets instead of cameras"}, o.replay);
  f.otherwise({"recording",
               "recording to replay (default: the rig's), or to record into (default: "
               "<out>/recording)"},
              o.recording);
  f.otherwise({"out", "output folder (default: out/<rig name>)"}, o.out);
  f.otherwise({"port", "port; 0: any free one", 1, 0, 65535}, o.port);
  f.otherwise({"address",
               "address to listen on; another than this machine's own opens the bench "
               "to whoever has the token"},
              o.address);
}

}  // namespace drape::console

namespace {

volatile sig_atomic_t asked_to_end = 0;  ///< the signal
sem_t end_is_asked;

void on_end(int signal) {
  asked_to_end = signal;
  ::sem_post(&end_is_asked);
}

/// Serves until a signal, then finishes what is open; a second signal ends the program immediately.
/// Returns 128 + signal.
int serve_until_asked(console::Console& bench) {
  ::sem_init(&end_is_asked, 0, 0);
  struct sigaction action {};
  action.sa_handler = &on_end;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  std::atomic<bool> served = false;
  std::thread ending([&bench, &served] {
    while (::sem_wait(&end_is_asked) != 0 && errno == EINTR) {
    }
    if (!served) std::fputs("\nthe console ends; everything stored stays\n", stderr);
    // A server that does not listen yet would miss the stop.
    while (!served) {
      bench.stop();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  });
  bench.serve();
  served = true;
  ::sem_post(&end_is_asked);
  ending.join();
  return asked_to_end == 0 ? 0 : 128 + asked_to_end;
}

}  // namespace

int main(int argc, char** argv) {
  Command app(
      "Serves the bench as a page in the browser, on this machine only: cameras, calibration, "
      "drapes,\nhistory and the session's log. Ctrl-C ends it; what was stored stays.\n\n"
      "  drape bench rigs/bench1 --replay     the recorded sets of the example, without a camera\n"
      "  drape bench rigs/lab                 the cameras of cameras.toml, which stay open",
      "drape-bench");
  console::ConsoleOptions options;
  CommonOptions common;
  app.add_record(options);
  add_common_options(app, common);
  return run_program(app, argc, argv, common, [&] {
    // Some 50 threads answer in turn, and each memory arena keeps the size of its largest answer.
    ::mallopt(M_ARENA_MAX, 2);
    console::Console bench(options);
    if (common.json) {
      print_text(pretty(Json{{"address", bench.addresses().front()}}));
    } else {
      print_text(fmt::format("open {}\nCtrl-C ends it; everything stored stays\n",
                             fmt::join(bench.addresses(), "\n  or ")));
    }
    return serve_until_asked(bench);
  });
}
