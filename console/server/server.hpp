// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "core/files/json_file.hpp"

namespace drape::console {

/// Server-sent events, from any thread to any number of readers. A slow reader loses old events but
/// never blocks the others: each event says that something changed, and the page requests what.
class Events {
 public:
  /// Sends an event; `name` without line ends, `data` in one line.
  void send(const std::string& name, const std::string& data);
  /// Returns the events after `last` as sent over the wire, and advances `last`; empty if none
  /// came.
  [[nodiscard]] std::string after(std::uint64_t& last) const;
  [[nodiscard]] std::uint64_t newest() const { return newest_; }
  /// Calls `bell` at every event, from the thread that sends it; an empty one ends that.
  void ring(std::function<void()> bell);

 private:
  static constexpr std::size_t kKept = 256;
  mutable std::mutex mutex_;
  std::deque<std::string> kept_;
  std::atomic<std::uint64_t> newest_ = 0;
  std::function<void()> bell_;
};

/// Parts of a request that decide whether it is accepted.
struct Knock {
  std::string method;
  std::string path;  ///< as sent, still percent-encoded
  std::string host;
  std::string reached = {};  ///< address and port at which the client reached this machine
  std::optional<std::string> origin, fetch_site, fetch_mode, content_type;
};

/// Access control. The token is the first part of every path: unlike a cookie it is not sent to
/// other ports of the same machine, and a page from elsewhere cannot know it.
struct Gate {
  std::string token;
  /// Names with port under which this server can be addressed, besides that at which it was
  /// reached; others (DNS rebinding) are refused.
  std::vector<std::string> hosts;
  std::string report_token = {};  ///< opens only the report

  struct Answer {
    int status = 0;  ///< 0 if accepted
    std::string why = {};
    std::string route = {};  ///< the path without the token, from its `/` on
  };
  [[nodiscard]] Answer ask(const Knock& knock) const;
  /// True if a path begins with a token.
  [[nodiscard]] bool knows(const std::string& path) const;
};

/// 128 random bits from the system as 32 hexadecimal digits. Throws Error(internal).
[[nodiscard]] std::string make_token();

/// A request accepted by the gate.
struct Request {
  std::string route;  ///< "/api/state"
  std::map<std::string, std::string> query;
  std::string body;
};

struct Response {
  int status = 200;
  std::string type = "application/json";
  std::string body = {};
  std::map<std::string, std::string> headers = {};  ///< further headers, or others than usual
};

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< to listen on
  int port = 0;                       ///< 0 for any free one
  std::string token;
  std::string report_token;  ///< opens only the report
};

/// HTTP server for one bench.
class WebServer {
 public:
  virtual ~WebServer() = default;
  /// "http://127.0.0.1:8040/<token>/", or several if it listens on every interface.
  [[nodiscard]] virtual std::vector<std::string> addresses() const = 0;
  /// Runs until SIGINT, SIGTERM or end(), then finishes what is being answered; a second signal
  /// ends the program immediately. Returns the signal, or 0.
  virtual int serve() = 0;
  virtual void end() = 0;
};

/// Listens immediately. `answer` is called from several threads at once; an Error that it throws is
/// sent as a sentence. `/api/events` is answered with `events`. Throws Error(usage) if the address
/// or port is not available.
[[nodiscard]] std::unique_ptr<WebServer> make_server(
    const ServerOptions& options, Events& events, std::function<Response(const Request&)> answer);

/// JSON on one line; bytes that are not UTF-8 are replaced.
[[nodiscard]] std::string dumped(const Json& json);

/// A response that names its cause.
[[nodiscard]] Response error_response(int status, const std::string& why);

}  // namespace drape::console
