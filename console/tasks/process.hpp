// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/program/child.hpp"

namespace drape::console {

/// A command of the front door: `drape detect ...`.
struct Call {
  std::vector<std::string> words;  ///< after `drape`, without --json
  /// Prepares required files; throws Error.
  std::function<void()> before = {};
  /// Called when its job begins; if empty, the call is always needed.
  std::function<bool()> needed = {};

  /// Command line as typed by a person, quoted for a shell.
  [[nodiscard]] std::string shown() const;
};

struct CallEnd {
  int exit_code = 0;
  std::string output;    ///< text on standard output
  std::string sentence;  ///< its verdict, or why it failed and what to do
};

/// Runs the `drape` beside the running program with these words and --json. The child dies with
/// this process; `child` is its id while it runs (otherwise 0), so that another thread can end it.
/// Throws Error(internal) if it cannot be started.
[[nodiscard]] CallEnd run_call(const Call& call, const ChildProgress& progress,
                               std::atomic<pid_t>& child);

}  // namespace drape::console
