// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>

#include "console/console.hpp"
#include "console/server/server.hpp"
#include "core/program/program.hpp"

namespace drape::console {

/// The files of the page by name, those it shares with the report under "page/": the build writes
/// their text into the program.
const std::map<std::string, std::string_view>& assets();

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

namespace {

/// Policy for a report, which has its own scripts and pictures: it is isolated from the page.
constexpr const char* kReportPolicy =
    "sandbox allow-scripts allow-modals; default-src 'none'; script-src "
    "'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action "
    "'none'; "
    "frame-ancestors 'none'";

/// Text of a file that only this user can read and write; empty if it is not such a file.
std::string own_text(const fs::path& file) {
  const int opened = ::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
  if (opened < 0) return {};
  struct stat status {};
  char text[64];
  const bool is_own = ::fstat(opened, &status) == 0 && S_ISREG(status.st_mode) &&
                      status.st_uid == ::geteuid() && (status.st_mode & 077) == 0;
  const ssize_t got = is_own ? ::read(opened, text, sizeof text) : 0;
  ::close(opened);
  return {text, got > 0 ? static_cast<std::size_t>(got) : 0};
}

/// The token persists with the folder, so that an open page continues to work after a restart. A
/// token planted by another user is replaced.
std::string token_of(const fs::path& folder) {
  const fs::path file = folder / "token";
  std::string token = own_text(file);
  const bool whole =
      token.size() == 32 && token.find_first_not_of("0123456789abcdef") == std::string::npos;
  if (whole) return token;
  token = make_token();
  const mode_t before = ::umask(077);
  write_durable(file, token);
  ::umask(before);
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  return token;
}

std::string type_of(const std::string& name) {
  if (name.ends_with(".html")) return "text/html; charset=utf-8";
  if (name.ends_with(".css")) return "text/css; charset=utf-8";
  return "text/javascript; charset=utf-8";
}

/// The bench in a browser: one rig, one output folder, one web server. Every action is written to
/// `<out>/console/session.jsonl` before it is answered, and every result is a file written by the
/// programs, so that the next console on the same folder shows the same state.
class Console {
 public:
  /// Listens immediately. Throws Error(usage) for an address in use, Error(bad_input) for a rig
  /// that cannot be read or a folder in use by another console.
  explicit Console(const ConsoleOptions& options)
      : bench_(options, [this](const std::string& name,
                               const Json& data) { events_.send(name, dumped(data)); }),
        server_(make_server({.address = options.address,
                             .port = options.port,
                             .token = token_of(bench_.session.own),
                             .report_token = report_token_},
                            events_, [this](const Request& request) { return answer(request); })) {}

  [[nodiscard]] std::vector<std::string> addresses() const { return server_->addresses(); }
  int serve() { return server_->serve(); }  ///< the signal that ended it

 private:
  Response answer(const Request& request) {
    const std::string& route = request.route;
    Query query = request.query;
    const auto width = [&] { return std::atoi(query["width"].c_str()); };
    if (route == "/api/do") {
      perform(bench_, request.body);
      return {200, "application/json", "{}"};
    }
    if (route == "/api/state") return {200, "application/json", state()};
    if (route == "/api/picture")
      return {200, "image/jpeg",
              picture(bench_, query["set"], query["camera"], width(), query["red"] == "1").jpeg};
    if (route == "/api/live") {
      const auto picture = bench_.cameras.picture(query["camera"], width(), query["red"] == "1");
      if (!picture) return error_response(404, "the camera has sent no picture yet");
      return {200, "image/jpeg", picture->jpeg, {{"X-Facts", picture->facts}}};
    }
    if (route.starts_with("/api/"))
      if (const auto json = view(bench_, route.substr(5), query))
        return {200, "application/json", dumped(*json)};
    if (route == "/api/report") {
      const fs::path file = bench_.session.run.report().replace_extension(".json");
      if (!fs::is_regular_file(file)) return error_response(404, "there is no report yet");
      return {200, "application/json", read_text(file)};
    }
    if (route == "/report.html") {
      const fs::path file = bench_.session.run.report();
      if (!fs::is_regular_file(fs::symlink_status(file)))
        return error_response(404, "there is no report yet");
      return {200,
              "text/html; charset=utf-8",
              read_text(file),
              {{"Content-Security-Policy", kReportPolicy}}};
    }
    const std::string name = route == "/" ? "index.html" : route.substr(1);
    const auto found = assets().find(name);
    if (found == assets().end()) return error_response(404, "there is nothing of this name");
    return {200, type_of(name), std::string(found->second)};
  }

  /// Many pages ask at once after every change: one text answers all requests made before it was
  /// started.
  std::string state() {
    const std::uint64_t mine = ++asked_;
    const std::lock_guard lock(state_mutex_);
    if (state_of_ < mine) {
      const std::uint64_t begun = asked_;
      Json json = view(bench_, "state", {}).value();
      json["report_token"] = report_token_;
      state_ = dumped(json);
      state_of_ = begun;
    }
    return state_;
  }

  /// A report contains scripts and sees its own address, so the token in that address opens nothing
  /// else.
  const std::string report_token_ = make_token();
  Events events_;
  Bench bench_;
  std::atomic<std::uint64_t> asked_ = 0;
  std::mutex state_mutex_;
  std::uint64_t state_of_ = 0;  ///< last request made when the text was started
  std::string state_;
  std::unique_ptr<WebServer> server_;
};

}  // namespace
}  // namespace drape::console

int main(int argc, char** argv) {
  using namespace drape;
  return run_command<console::ConsoleOptions>(
      argc, argv, "drape-bench",
      "Serves the bench as a page in the browser, on this machine only: cameras, calibration, "
      "drapes,\nhistory and the session's log. Ctrl-C ends it; what was stored stays.\n\n"
      "  drape bench rigs/bench1 --replay     the recorded sets of the example, without a camera\n"
      "  drape bench rigs/lab                 the cameras of cameras.toml, which stay open",
      [](const console::ConsoleOptions& options, const CommonOptions& common) {
        // Several threads answer in turn, and each memory arena keeps the size of its largest
        // answer.
        ::mallopt(M_ARENA_MAX, 2);
        console::Console bench(options);
        print_text(common.json ? pretty(Json{{"address", bench.addresses().front()}})
                               : fmt::format("open {}\nCtrl-C ends it; everything stored stays\n",
                                             fmt::join(bench.addresses(), "\n  or ")));
        const int signal = bench.serve();
        std::fputs("\nthe console ends; everything stored stays\n", stderr);
        return 128 + signal;
      });
}
