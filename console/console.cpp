// SPDX-License-Identifier: Apache-2.0
#include "console/console.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <mutex>

#include "console/bench.hpp"
#include "console/server/gate.hpp"
#include "console/server/server.hpp"
#include "console/web/assets.hpp"
#include "core/files/files.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;

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
  const bool whole = token.size() == 32 && std::all_of(token.begin(), token.end(), [](char c) {
                       return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
                     });
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

std::string dumped(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

class Console::Impl {
 public:
  explicit Impl(const ConsoleOptions& options)
      : bench_(options, [this](const std::string& name,
                               const Json& data) { events_.send(name, dumped(data)); }),
        server_(server_options(options), events_,
                [this](const Request& request) { return answer(request); }) {}

  WebServer& server() { return server_; }
  Events& events() { return events_; }

 private:
  [[nodiscard]] ServerOptions server_options(const ConsoleOptions& options) {
    ServerOptions server;
    server.address = options.address;
    server.port = options.port;
    server.token = token_of(bench_.session.own);
    server.report_token = report_token_;
    return server;
  }

  Response answer(const Request& request) {
    const std::string& route = request.route;
    const auto asked = [&](const char* name) {
      const auto found = request.query.find(name);
      return found == request.query.end() ? std::string() : found->second;
    };
    const auto width = [&] { return std::atoi(asked("width").c_str()); };
    const std::string api = "/api/";
    if (route == "/api/do") {
      perform(bench_, request.body);
      return {200, "application/json", "{}"};
    }
    if (route == "/api/state") return {200, "application/json", state()};
    if (route == "/api/picture")
      return {200, "image/jpeg",
              picture(bench_, asked("set"), asked("camera"), width(), asked("red") == "1").jpeg};
    if (route == "/api/live") {
      const auto picture = bench_.cameras.picture(asked("camera"), width(), asked("red") == "1");
      if (!picture) return absent("the camera has sent no picture yet");
      return {200, "image/jpeg", picture->jpeg, {{"X-Facts", picture->facts}}};
    }
    if (route.starts_with(api) && is_view(route.substr(api.size())))
      return {200, "application/json",
              dumped(view(bench_, route.substr(api.size()), request.query))};
    if (route == "/api/report") {
      const fs::path file = bench_.files.report_file().replace_extension(".json");
      if (!fs::is_regular_file(file)) return absent("there is no report yet");
      return {200, "application/json", read_text(file)};
    }
    if (route == "/report.html") {
      const fs::path file = bench_.files.report_file();
      if (!fs::is_regular_file(fs::symlink_status(file))) return absent("there is no report yet");
      return {200, "text/html; charset=utf-8", read_text(file), {}, kReportPolicy};
    }
    const std::string name = route == "/" ? "index.html" : route.substr(1);
    const auto found = assets().find(name);
    if (found == assets().end()) return absent("there is nothing of this name");
    return {200, type_of(name), std::string(found->second)};
  }

  static Response absent(const std::string& why) {
    return {404, "application/json", dumped({{"error", why}})};
  }

  /// Many pages ask at once after every change: one text answers all requests made before it was
  /// started.
  std::string state() {
    const std::uint64_t mine = ++asked_;
    const std::lock_guard lock(state_mutex_);
    if (state_of_ < mine) {
      const std::uint64_t begun = asked_;
      Json json = view(bench_, "state", {});
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
  WebServer server_;
};

Console::Console(const ConsoleOptions& options) : impl_(std::make_unique<Impl>(options)) {}

Console::~Console() = default;

std::vector<std::string> Console::addresses() const {
  return impl_->server().addresses();
}

void Console::serve() {
  impl_->server().serve();
}

void Console::stop() {
  impl_->events().close();
  impl_->server().stop();
}

}  // namespace drape::console
