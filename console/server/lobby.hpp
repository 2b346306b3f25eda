// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace drape::console {

/// Sockets whose request has not arrived yet: one thread waits for all of them, so that silent ones
/// do not occupy threads needed by clients with the token. Sockets are counted before they are
/// queued: if too many wait, the one waiting longest is closed.
class Lobby {
 public:
  struct Options {
    int workers = 48;
    int strangers = 8;  ///< threads for requests without the token
    std::size_t waiting = 256;
    double patience_s = 2;  ///< for the first line of a request, s
  };
  /// `knows`: whether a request's path contains the token. `serve` answers a socket and closes it.
  Lobby(Options options, std::function<bool(const std::string& path)> knows,
        std::function<void(int socket, bool is_known)> serve);
  ~Lobby();
  Lobby(const Lobby&) = delete;
  Lobby& operator=(const Lobby&) = delete;

  void enter(int socket);
  /// Closes all waiting sockets, and waits for those being served.
  void close();

 private:
  using Clock = std::chrono::steady_clock;
  struct Guest {
    int socket = -1;
    Clock::time_point since;
    bool has_begun = false;  ///< true if a part of its first line has arrived
    bool is_known = false, is_ready = false, is_gone = false;
  };
  void watch();
  void look_at(Guest& guest) const;
  void work();

  Options options_;
  std::function<bool(const std::string&)> knows_;
  std::function<void(int, bool)> serve_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Guest> entered_;
  std::deque<Guest> ready_;
  int strangers_ = 0;  ///< number being served
  bool ending_ = false;
  int bell_ = -1;  ///< an eventfd, signalled when a socket enters
  std::thread watcher_;
  std::vector<std::thread> workers_;
};

}  // namespace drape::console
