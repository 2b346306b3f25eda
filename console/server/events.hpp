// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>

namespace drape::console {

/// Server-sent events, from any thread to any number of readers. A reader that is slow loses old
/// events, never stops the others: each event says that something changed, the page asks what.
class Events {
 public:
  /// `name` without line ends, `data` in one line.
  void send(const std::string& name, const std::string& data);
  /// The events after `last` as they go over the wire, and `last` moved on; empty after `patience`
  /// without any, or once closed.
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
