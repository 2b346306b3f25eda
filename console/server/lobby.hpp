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

/// Sockets whose request has not come yet: one thread waits for all of them, so that those that
/// say nothing hold no thread of those who have the token. Counted before they are queued: where
/// too many wait, the one that waits longest is cut.
class Lobby {
 public:
  struct Options {
    int workers = 48;
    int strangers = 8;  ///< workers for requests without the token
    std::size_t waiting = 256;
    double patience_s = 2;  ///< for the first line of a request
  };
  /// `knows`: the path of a request holds the token. `serve` answers a socket and closes it.
  Lobby(Options options, std::function<bool(const std::string& path)> knows,
        std::function<void(int socket, bool is_known)> serve);
  ~Lobby();
  Lobby(const Lobby&) = delete;
  Lobby& operator=(const Lobby&) = delete;

  void enter(int socket);
  /// Cuts all that wait, and waits for what is being served.
  void close();

 private:
  using Clock = std::chrono::steady_clock;
  struct Guest {
    int socket = -1;
    Clock::time_point since;
    bool has_begun = false;  ///< part of its first line is there
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
  int strangers_ = 0;  ///< being served
  bool ending_ = false;
  int bell_ = -1;  ///< an eventfd: somebody has entered
  std::thread watcher_;
  std::vector<std::thread> workers_;
};

}  // namespace drape::console
