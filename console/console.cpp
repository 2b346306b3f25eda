// SPDX-License-Identifier: Apache-2.0
#include "console/console.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

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

/// A report carries its own scripts and pictures, and nothing else: it runs apart from the page.
constexpr const char* kReportPolicy =
    "sandbox allow-scripts allow-popups allow-modals; default-src 'none'; script-src "
    "'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action "
    "'none'; "
    "frame-ancestors 'none'";

/// The token lives as long as the folder, so that an open page goes on when the server is started
/// again. Only its owner may read it.
std::string token_of(const fs::path& folder) {
  const fs::path file = folder / "token";
  if (fs::is_regular_file(fs::symlink_status(file))) {
    struct stat status {};
    std::string token = read_text(file);
    const bool whole = token.size() == 32 && std::all_of(token.begin(), token.end(), [](char c) {
                         return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
                       });
    if (whole && ::stat(file.c_str(), &status) == 0 && (status.st_mode & 077) == 0) return token;
  }
  std::string token = make_token();
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
  [[nodiscard]] ServerOptions server_options(const ConsoleOptions& options) const {
    ServerOptions server;
    server.address = options.address;
    server.port = options.port;
    server.token = token_of(bench_.report().parent_path() / "console");
    return server;
  }

  Response answer(const Request& request) {
    const std::string& route = request.route;
    const auto asked = [&](const char* name) {
      const auto found = request.query.find(name);
      return found == request.query.end() ? std::string() : found->second;
    };
    Response response;
    if (route == "/api/do") {
      const Json act = try_json(request.body);
      bench_.act(act);
      response.body = "{}";
    } else if (route == "/api/state") {
      response.body = state();
    } else if (route == "/api/marks") {
      response.body = dumped(bench_.marks(asked("set")));
    } else if (route == "/api/live-marks") {
      response.body = dumped(bench_.live_marks(asked("surface") == "cloth"));
    } else if (route == "/api/frame") {
      response.body = dumped(bench_.frame_facts(asked("set")));
    } else if (route == "/api/coverage") {
      response.body = dumped(bench_.coverage());
    } else if (route == "/api/coach") {
      response.body = dumped(bench_.coach());
    } else if (route == "/api/sheet") {
      response.body = dumped(bench_.sheet(asked("drape")));
    } else if (route == "/api/history") {
      response.body = dumped(bench_.history());
    } else if (route == "/api/diff") {
      response.body = dumped(bench_.difference(asked("a"), asked("b")));
    } else if (route == "/api/picture") {
      response.type = "image/jpeg";
      response.body = bench_
                          .picture(asked("set"), asked("camera"), std::atoi(asked("width").c_str()),
                                   asked("red") == "1")
                          .jpeg;
    } else if (route == "/api/live") {
      const auto picture = bench_.live_picture(asked("camera"), std::atoi(asked("width").c_str()),
                                               asked("red") == "1");
      if (!picture)
        return {404, "application/json", R"({"error":"the camera has sent no picture yet"})"};
      response.type = "image/jpeg";
      response.body = picture->jpeg;
      response.headers["X-Facts"] = picture->facts;
    } else if (route == "/report.html") {
      if (!fs::is_regular_file(fs::symlink_status(bench_.report())))
        return {404, "application/json", R"({"error":"there is no report yet"})"};
      response = {200, "text/html; charset=utf-8", read_text(bench_.report()), {}, kReportPolicy};
    } else {
      const std::string name = route == "/" ? "index.html" : route.substr(1);
      const auto found = assets().find(name);
      if (found == assets().end())
        return {404, "application/json", R"({"error":"there is nothing of this name"})"};
      response = {200, type_of(route == "/" ? "index.html" : name), std::string(found->second)};
    }
    return response;
  }

  /// Many pages ask at once whenever something changed: one text answers all that asked before it
  /// was begun.
  std::string state() {
    const std::uint64_t mine = ++asked_;
    const std::lock_guard lock(state_mutex_);
    if (state_of_ < mine) {
      const std::uint64_t begun = asked_;
      state_ = dumped(bench_.state());
      state_of_ = begun;
    }
    return state_;
  }

  Events events_;
  Bench bench_;
  std::atomic<std::uint64_t> asked_ = 0;
  std::mutex state_mutex_;
  std::uint64_t state_of_ = 0;  ///< the last that had asked when the text was begun
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
