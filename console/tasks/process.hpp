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

/// One command of the front door: `drape detect ...`.
struct Call {
  std::vector<std::string> words;  ///< after `drape`, without --json
  /// Writes what must be there first; throws Error.
  std::function<void()> before = {};
  /// Asked when its job begins; empty: always.
  std::function<bool()> needed = {};

  /// As a person types it, quoted where a shell needs it.
  [[nodiscard]] std::string shown() const;
};

struct CallEnd {
  int exit_code = 0;
  std::string output;    ///< text on standard output
  std::string sentence;  ///< its verdict, or why it failed and what to do
};

/// Runs `drape` beside the running program with the words and --json. The child dies with this
/// process; `child` holds its id while it runs (0 otherwise), so that another thread can end it.
/// Throws Error(internal) when it cannot be started.
[[nodiscard]] CallEnd run_call(const Call& call, const ChildProgress& progress,
                               std::atomic<pid_t>& child);

}  // namespace drape::console
