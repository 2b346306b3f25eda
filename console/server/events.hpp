// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>

namespace drape::console {

/// Server-sent events, from any thread to any number of readers. A slow reader loses old events but
/// never blocks the others: each event says that something changed, and the page requests what.
class Events {
 public:
  /// Sends an event; `name` without line ends, `data` in one line.
  void send(const std::string& name, const std::string& data);
  /// Returns the events after `last` as sent over the wire, and advances `last`; empty if none came
  /// within `patience`, or once closed.
  [[nodiscard]] std::string wait(std::uint64_t& last, std::chrono::milliseconds patience);
  [[nodiscard]] std::uint64_t newest() const;
  void close();
  [[nodiscard]] bool closed() const;

 private:
  static constexpr std::size_t kKept = 256;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::string> kept_;
  std::uint64_t newest_ = 0;
  bool closed_ = false;
};

}  // namespace drape::console
