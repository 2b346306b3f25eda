// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "front/process.hpp"

namespace drape {

struct RunOptions {
  std::filesystem::path rig;
  std::filesystem::path recording;  ///< empty: the rig's
  std::filesystem::path out;        ///< empty: out/<rig name>
  std::filesystem::path store;      ///< empty: <out>/results.sqlite
  int threads = 1;
  bool single = false;  ///< no ensemble of starts for each drape
};

/// Steps that may run side by side; the next group needs all of this one.
struct Group {
  std::string stage;
  std::vector<Step> steps;
  int at_once = 1;
};

/// What `drape run` does, in order: every step with its command line.
struct Plan {
  std::filesystem::path out;
  std::filesystem::path store;
  std::filesystem::path report;
  std::vector<Group> groups;
};

/// Reads rig, target, prints and scenes, so that a fault in any of them is named before hours of
/// work start, and lays out the steps. Throws Error(bad_input).
[[nodiscard]] Plan make_plan(const RunOptions& options);

}  // namespace drape
