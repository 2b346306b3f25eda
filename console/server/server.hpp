// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "console/server/events.hpp"

namespace drape::console {

/// One request behind the gate.
struct Request {
  std::string route;  ///< "/api/state"
  std::map<std::string, std::string> query;
  std::string body;
};

struct Response {
  int status = 200;
  std::string type = "application/json";
  std::string body = {};
  std::map<std::string, std::string> headers = {};  ///< more of them
  std::string policy = {};  ///< Content-Security-Policy; empty: the page's own
};

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< to listen on
  int port = 0;                       ///< 0: any free one
  std::string token;
  std::string report_token;        ///< opens the report alone
  double request_s = 10;           ///< a request that takes longer to arrive is cut
  double stranger_s = 2;           ///< a socket that has shown no token is cut
  double write_s = 5;              ///< a client that takes nothing for so long is cut
  int connections = 48;            ///< served at once; one thread each
  int watchers = 24;               ///< readers of events
  std::size_t body_bytes = 65536;  ///< largest body of a request
};

/// HTTP for one bench. `answer` is called from several threads at once; an Error that it throws
/// becomes a sentence. `/api/events` is answered with `events`.
class WebServer {
 public:
  using Answer = std::function<Response(const Request&)>;
  /// Listens at once. Throws Error(usage) when the address or port cannot be had.
  WebServer(const ServerOptions& options, Events& events, Answer answer);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// "http://127.0.0.1:8040/<token>/"; more where it listens on every interface.
  [[nodiscard]] std::vector<std::string> addresses() const;
  void serve();  ///< until stop()
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace drape::console
