// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "console/server/events.hpp"

namespace drape::console {

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
  std::map<std::string, std::string> headers = {};  ///< additional headers
  std::string policy = {};  ///< Content-Security-Policy; empty for that of the page
};

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< to listen on
  int port = 0;                       ///< 0 for any free one
  std::string token;
  std::string report_token;        ///< opens only the report
  double request_s = 10;           ///< longest time for a request to arrive, s
  double stranger_s = 2;           ///< longest time for a socket to show a token, s
  double write_s = 5;              ///< longest time for which a client may not read, s
  int connections = 48;            ///< served at the same time, one thread each
  int watchers = 24;               ///< largest number of readers of events
  std::size_t body_bytes = 65536;  ///< largest body of a request
};

/// HTTP server for one bench. `answer` is called from several threads at once; an Error that it
/// throws is sent as a sentence. `/api/events` is answered with `events`.
class WebServer {
 public:
  using Answer = std::function<Response(const Request&)>;
  /// Listens immediately. Throws Error(usage) if the address or port is not available.
  WebServer(const ServerOptions& options, Events& events, Answer answer);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// "http://127.0.0.1:8040/<token>/", or several if it listens on every interface.
  [[nodiscard]] std::vector<std::string> addresses() const;
  void serve();  ///< runs until stop()
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace drape::console
