// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/shell_word.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/study/plan.hpp"
#include "simulate/study/study.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

namespace {

struct PlanArguments {
  std::string part = "1/1";
};

constexpr std::size_t kMostNamed = 20;  ///< cases in the ending; study.csv has all

std::string name_of(const StudyCase& c) {
  return fmt::format("{} {} {} {}-{} seed {}", c.scene, c.fabric_file.stem().string(),
                     drape::name_of(c.model), c.grid, c.segments, c.seed);
}

Ending ending_of(const std::vector<PlannedOutcome>& outcomes) {
  std::array<int, 5> counts{};
  int resting = 0;
  Ending ending;
  for (const PlannedOutcome& planned : outcomes) {
    ++counts[static_cast<std::size_t>(planned.state)];
    resting += planned.state == CaseState::done && planned.outcome.at_rest;
    const bool named = planned.state == CaseState::failed ||
                       planned.state == CaseState::impossible ||
                       (planned.state == CaseState::done && !planned.outcome.at_rest);
    if (named && ending.rejected.size() < kMostNamed)
      ending.rejected.push_back(fmt::format(
          "{}: {}{}", name_of(planned.outcome.the_case),
          planned.state == CaseState::impossible ? "cannot run: " : "", planned.outcome.sentence));
  }
  const auto count = [&](CaseState state) { return counts[static_cast<std::size_t>(state)]; };
  ending.go = resting == static_cast<int>(outcomes.size());
  ending.verdict = fmt::format("{} of {} drapes at rest", resting, outcomes.size());
  ending.numbers = {{"done, not at rest", std::to_string(count(CaseState::done) - resting)},
                    {"failed", std::to_string(count(CaseState::failed))},
                    {"being computed", std::to_string(count(CaseState::computing))},
                    {"missing", std::to_string(count(CaseState::missing))}};
  if (count(CaseState::impossible) > 0)
    ending.numbers.emplace_back("cannot run", std::to_string(count(CaseState::impossible)));
  return ending;
}

/// First warnings; the certificate of each case has its own.
std::vector<std::string> first_of(std::vector<std::string> warnings) {
  const std::size_t more = warnings.size() - std::min(warnings.size(), kMostNamed);
  warnings.resize(warnings.size() - more);
  if (more > 0) warnings.push_back(fmt::format("{} more of such, in the certificates", more));
  return warnings;
}

/// Oddities of the fabrics of a study, each once.
std::vector<std::string> fabric_warnings(const std::vector<StudyCase>& cases) {
  std::set<fs::path> fabrics, scenes;
  for (const StudyCase& one : cases)
    if (!one.fabric_file.empty())
      fabrics.insert(one.fabric_file);
    else if (scenes.insert(one.scene_file).second)
      fabrics.insert(read_scene(one.scene_file).fabric_file);
  std::vector<std::string> warnings;
  for (const fs::path& fabric : fabrics)
    for (const std::string& warning : read_fabric(fabric).warnings) warnings.push_back(warning);
  return warnings;
}

int compute(const fs::path& plan_file, const std::string& part_text, const fs::path& out,
            const CommonOptions& common) {
  const fs::path program = fs::read_symlink("/proc/self/exe");
  const Part part = part_of(part_text);
  StudyPlan plan = read_plan(plan_file, out, program);
  plan.options.threads = thread_count(common);
  Progress progress("study", common.quiet);
  std::size_t ended = 0;
  const double all = std::max(1.0, static_cast<double>(plan.cases.size()) / part.count);
  const std::vector<PlannedOutcome> outcomes =
      run_part(plan, part, out, program, [&](const PlannedOutcome& planned) {
        progress.update(std::min(1.0, static_cast<double>(++ended) / all),
                        name_of(planned.outcome.the_case));
      });
  Ending ending = ending_of(outcomes);
  ending.warnings = first_of(fabric_warnings(plan.cases));
  ending.next_command = fmt::format("drape study status {} --out {}",
                                    shell_word(plan_file.string()), shell_word(out.string()));
  return finish(ending, common);
}

int count(const fs::path& plan_file, const fs::path& out, const CommonOptions& common) {
  const StudyPlan plan = read_plan(plan_file, out, fs::read_symlink("/proc/self/exe"));
  const std::vector<PlannedOutcome> outcomes = plan_status(plan);
  write_durable(out / "study.csv", plan_csv(outcomes));
  Ending ending = ending_of(outcomes);
  ending.warnings = first_of(fabric_warnings(plan.cases));
  ending.numbers.emplace_back("table", (out / "study.csv").string());
  if (!ending.go)
    ending.next_command = fmt::format("drape study {} --out {}", shell_word(plan_file.string()),
                                      shell_word(out.string()));
  return finish(ending, common);
}

/// RIG or PLAN, --out, --part, and the subcommand `status`.
void add_plan_options(Command& app, fs::path& rig, fs::path& out, PlanArguments& arguments) {
  app.fallthrough();
  app.add_option("RIG", rig, "folder with scenes/, e.g. rigs/paper, or a plan.toml");
  app.add_option("--out", out,
                 "folder for <scene>/<model>/<grid>-<segments>/ and the tables; of a plan: for all "
                 "its parts");
  app.add_option("--part", arguments.part, "of a plan: I/N, every N-th case from the I-th on")
      ->capture_default_str();
  Command* status = app.add_subcommand(
      "status", "counts what of a plan is done, failed, missing or cannot run; writes study.csv");
  status->add_option("PLAN", rig, "plan.toml")->required();
  status->add_option("--out", out, "as given to the parts")->required();
}

/// Throws Error(usage) when --part is given, for the reason `why` it would do nothing.
void require_no_part(const Command& app, const std::string& why) {
  if (app.count("--part") > 0) throw usage_error(why, "leave --part out");
}

/// True if a plan was given and not a rig.
bool is_plan(const Command& app, const fs::path& rig) {
  return app.chosen() != nullptr || rig.extension() == ".toml";
}

/// `drape study PLAN --part I/N --out DIR` computes one part; `drape study status PLAN --out DIR`
/// counts what is done and writes DIR/study.csv. Exit code.
int run_plan(const Command& app, const fs::path& plan, const fs::path& out,
             const PlanArguments& arguments, const CommonOptions& common) {
  for (const char* option : {"--scenes", "--grids", "--segments", "--models", "--solvers",
                             "--max-steps", "--thickness-mm"}) {
    if (app.count(option) > 0)
      throw usage_error(fmt::format("{} cannot change a plan", option),
                        "write it into the plan file");
  }
  if (app.chosen() != nullptr) {
    require_no_part(app, "status counts all parts of a plan");
    return count(plan, out, common);
  }
  if (out.empty()) throw usage_error("--out is missing", "give a folder for all parts");
  return compute(plan, arguments.part, out, common);
}

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
        progress.update(static_cast<double>(ended) / static_cast<double>(cases.size()),
                        fmt::format("{} {} {}x{}, {} segments: {}", o.the_case.scene,
                                    drape::name_of(o.the_case.model), o.the_case.grid,
                                    o.the_case.grid, o.the_case.segments, o.sentence));
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
      ending.rejected.push_back(fmt::format("{} {} {}-{}: {}", o.the_case.scene,
                                            drape::name_of(o.the_case.model), o.the_case.grid,
                                            o.the_case.segments, o.sentence));
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
  app.add_record(options);
  return run_program(app, argc, argv, common, [&] {
    if (is_plan(app, rig)) return run_plan(app, rig, out, plan, common);
    require_no_part(app, "a rig is no plan and has no parts");
    return run_study(rig, out, options, arguments_of(argc, argv), common);
  });
}

}  // namespace drape::simulate
