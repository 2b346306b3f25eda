// SPDX-License-Identifier: Apache-2.0
#include "simulate/programs/study_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/progress.hpp"
#include "core/program/shell_word.hpp"
#include "simulate/study/plan.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNamed = 20;  ///< cases in the ending; study.csv has all

std::string name_of(const StudyCase& c) {
  return fmt::format("{} {} {} {}-{} seed {}", c.scene, c.fabric_file.stem().string(), c.model,
                     c.grid, c.segments, c.seed);
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

/// Those that are named; the certificate of each case has its own.
std::vector<std::string> first_of(std::vector<std::string> warnings) {
  const std::size_t more = warnings.size() - std::min(warnings.size(), kMostNamed);
  warnings.resize(warnings.size() - more);
  if (more > 0) warnings.push_back(fmt::format("{} more of such, in the certificates", more));
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

}  // namespace

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

void require_no_part(const Command& app, const std::string& why) {
  if (app.count("--part") > 0) throw usage_error(why, "leave --part out");
}

bool is_plan(const Command& app, const fs::path& rig) {
  return app.chosen() != nullptr || rig.extension() == ".toml";
}

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

}  // namespace drape::simulate
