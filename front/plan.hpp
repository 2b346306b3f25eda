// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "front/process.hpp"

namespace drape {

struct RunOptions {
  std::filesystem::path rig;
  std::filesystem::path recording;  ///< empty: the rig's
  std::filesystem::path out;        ///< empty: out/<rig name>
  std::filesystem::path store;      ///< empty: <out>/results.sqlite
  std::string label;                ///< name of the run in the store; may be empty
  std::string operator_name;
  bool uncertainty = false;         ///< with `single`: still the sensitivities that U needs
  bool single = false;              ///< the scene's own start alone
  std::optional<double> spacing_m;  ///< spacing of the finest mesh; absent: the rig's
  bool paper = false;               ///< beside the cloth the paper's model on the rig's grids
  bool internal_friction = false;   ///< simulate with both branches of the curves' loops
  int threads = 1;
};

void fields(Fields& f, RunOptions& options);

/// Steps that may run side by side; the next group needs all of this one.
struct Group {
  std::string stage;
  std::vector<Step> steps;
  int at_once = 1;
  bool is_for_some = false;  ///< not every drape has such a step
};

/// Steps of `drape run`, in order, with their command lines.
struct Plan {
  std::filesystem::path out;
  std::filesystem::path store;
  std::filesystem::path report;
  std::vector<Group> groups;  ///< all stages but compare
  /// Compares all sheets but those whose run records stand in `failed`.
  std::function<Step(const std::set<std::filesystem::path>& failed)> compare = {};
  std::function<void()> write_reduced_rig = {};  ///< for the first steps, before they start
};

/// Lays out the steps of a bench that check_bench() found nothing against. Throws Error(bad_input).
[[nodiscard]] Plan make_plan(const RunOptions& options);

}  // namespace drape
