// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace drape::console {

/// One command of the front door: `drape detect ...`.
struct Call {
  std::vector<std::string> words;  ///< after `drape`, without --json
  /// What must be written first; throws Error.
  std::function<void()> before = {};
  /// Asked when its job begins; empty: always.
  std::function<bool()> needed = {};

  /// As a person types it, quoted where a shell needs it.
  [[nodiscard]] std::string shown() const;
};

struct CallEnd {
  int exit_code = 0;
  std::string output;    ///< what it printed on standard output
  std::string sentence;  ///< its verdict, or why it failed and what to do
};

/// Fraction (0..1) and text.
using CallProgress = std::function<void(double, const std::string&)>;

/// Descriptors that a program gets; -1: none (in: an empty input, err: that of this process).
struct Streams {
  int in = -1, out = -1, err = -1;
  int progress = -1;
};

/// Starts `drape` beside the running program with the words. The child dies with this process.
/// Throws Error(internal) when it cannot be started.
[[nodiscard]] pid_t start_program(const std::vector<std::string>& words, const Streams& streams);

/// Runs `drape` beside the running program with the words and --json. The child dies with this
/// process; `child` holds its id while it runs (0 otherwise), so that another thread can end it.
/// Throws Error(internal) when it cannot be started.
[[nodiscard]] CallEnd run_call(const Call& call, const CallProgress& progress,
                               std::atomic<pid_t>& child);

}  // namespace drape::console
