// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/shell_word.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/study_parts.hpp"
#include "simulate/study/study.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

namespace {

int run_study(const fs::path& rig, const fs::path& out, StudyOptions options,
              std::vector<std::string> words, const CommonOptions& common) {
  if (rig.empty() || out.empty())
    throw usage_error("RIG or --out is missing", "give both, e.g. rigs/paper --out study");
  RunRecord record("drape-simulate", std::move(words), out / "study.run.json");
  options.threads = thread_count(common);
  const std::vector<StudyCase> cases = study_cases(rig, out, options);
  Progress progress("study", common.quiet);
  std::size_t ended = 0;
  const std::vector<StudyOutcome> outcomes =
      run_study(cases, options, fs::read_symlink("/proc/self/exe"), [&](const StudyOutcome& o) {
        ++ended;
        progress.update(
            static_cast<double>(ended) / static_cast<double>(cases.size()),
            fmt::format("{} {} {}x{}, {} segments: {}", o.the_case.scene, o.the_case.model,
                        o.the_case.grid, o.the_case.grid, o.the_case.segments, o.sentence));
      });
  std::optional<fs::path> published;
  if (fs::exists(rig / "published.csv")) published = rig / "published.csv";
  const std::string tables = study_tables(outcomes, published);
  write_durable(out / "study.csv", study_csv(outcomes));
  write_durable(out / "study.md", tables);
  for (const char* name : {"study.csv", "study.md"}) record.output(out / name);
  for (const StudyOutcome& o : outcomes) record.input(o.the_case.folder / "sheet.json");
  Ending ending;
  const auto resting =
      std::count_if(outcomes.begin(), outcomes.end(), [](const auto& o) { return o.at_rest; });
  ending.go = resting == static_cast<std::ptrdiff_t>(outcomes.size());
  ending.verdict = fmt::format("{} of {} drapes at rest", resting, outcomes.size());
  for (const StudyOutcome& o : outcomes) {
    if (!o.at_rest)
      ending.rejected.push_back(fmt::format("{} {} {}-{}: {}", o.the_case.scene, o.the_case.model,
                                            o.the_case.grid, o.the_case.segments, o.sentence));
  }
  ending.warnings = fabric_warnings(cases);
  ending.next_command = fmt::format("more {}", shell_word((out / "study.md").string()));
  if (!common.json && !common.quiet) fmt::print("{}\n", tables);
  return finish(ending, common, record);
}

}  // namespace

int study_command(int argc, char** argv) {
  Command app("Drapes every scene of a rig with several grids, segments and models.",
              "drape-simulate study");
  CommonOptions common;
  add_common_options(app, common);
  fs::path rig, out;
  StudyOptions options;
  PlanArguments plan;
  add_plan_options(app, rig, out, plan);
  app.add_option("--scenes", options.scenes, "names, comma-separated; default: all")
      ->delimiter(',');
  const auto list = [&app](const char* name, auto& values, const char* what) {
    app.add_option(name, values, what)->delimiter(',')->capture_default_str();
  };
  list("--grids", options.grids, "particles per side");
  list("--segments", options.segments, "line segments per Kawabata curve");
  list("--models", options.models, "consistent, paper");
  list("--solvers", options.solvers, "tried in this order until one comes to rest");
  app.add_option("--max-steps", options.simulate.max_steps, "step limit of a run")
      ->capture_default_str();
  double thickness_mm = 0.5;
  app.add_option("--thickness-mm", thickness_mm,
                 "layers of cloth keep this apart; 0: the sheet passes through itself (rk4)")
      ->capture_default_str();
  return run_program(app, argc, argv, common, [&] {
    if (is_plan(app, rig)) return run_plan(app, rig, out, plan, common);
    require_no_part(app, "a rig is no plan and has no parts");
    options.simulate.cloth_thickness_m = thickness_mm * 1e-3;
    return run_study(rig, out, options, arguments_of(argc, argv), common);
  });
}

}  // namespace drape::simulate
