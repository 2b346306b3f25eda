// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/program/program.hpp"
#include "front/process.hpp"

namespace drape {

/// Stages after which a run may end.
enum class LastStage { compare, calib, triangulate };
template <>
inline constexpr std::string_view names_of<LastStage>[] = {"compare", "calib", "triangulate"};

struct RunOptions {
  std::filesystem::path rig;
  std::filesystem::path recording;  ///< empty for that of the rig
  std::filesystem::path out;        ///< empty for out/<rig name>
  std::filesystem::path store;      ///< empty for <out>/results.sqlite
  std::string label;                ///< name of the run in the store; can be empty
  std::string operator_name;
  bool uncertainty = false;         ///< with `single`: still compute the sensitivities needed for U
  bool single = false;              ///< simulate the scene's own start only
  std::optional<double> spacing_m;  ///< spacing of the finest mesh; absent for that of the rig
  bool paper = false;               ///< also simulate the paper's model on the rig's grids
  bool internal_friction = false;   ///< simulate with both branches of the hysteresis loops
  LastStage until = LastStage::compare;
  std::vector<std::string> drapes;  ///< drapes to make; empty for all
  int threads = 1;
};

void fields(Fields& f, RunOptions& options);

/// One step of a run.
struct RunStep : Step {
  std::filesystem::path record = {};  ///< run record that proves it up to date
  double weight = 1;                  ///< share of the stage's time
  std::string drape = {};  ///< drape that fails with this step; empty if all drapes need it
  std::string scene = {};  ///< name of the drape, also for its repeats
  bool is_asked = true;    ///< false: not run, but kept if it is up to date
  bool is_extra = false;   ///< true if its failure only makes the result less complete
};

/// Steps that can run in parallel; the next group needs all of this one.
struct Group {
  std::string stage;
  std::vector<RunStep> steps;
  int at_once = 1;
  bool is_for_some = false;  ///< true if only some drapes have this step
};

/// Steps of `drape run`, in order, with their command lines.
struct Plan {
  std::filesystem::path out;
  std::filesystem::path store;
  std::filesystem::path report;
  std::vector<Group> groups;  ///< all stages except compare
  /// Makes the step that compares all sheets except those whose run records are in `failed`; empty
  /// if the run ends earlier.
  std::function<RunStep(const std::set<std::filesystem::path>& failed)> compare = {};
  std::function<void()> write_reduced_rig = {};  ///< for the first steps; call it before they start
};

/// Plans the steps for a bench without problems in check_bench(). Throws Error(bad_input).
[[nodiscard]] Plan make_plan(const RunOptions& options);

/// `drape run`: runs every stage in order, skipping steps that are up to date. Returns the exit
/// code: 0 GO, 1 if a stage's verdict is NO-GO, else that of the stage that failed.
[[nodiscard]] int run_bench(const RunOptions& options, const CommonOptions& common);

}  // namespace drape
