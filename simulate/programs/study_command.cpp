// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/study/study.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

namespace {

struct StatusArguments {
  fs::path plan, out;
};

void fields(Fields& f, StatusArguments& args) {
  f(Field{"plan", "plan.toml, or folder of a rig"}.called("PLAN"), args.plan);
  f({"out", "output folder given to the parts"}, args.out);
}

struct StudyArguments {
  fs::path rig, out;
  std::string part = "1/1";
  PlanChoice choice;
};

void fields(Fields& f, StudyArguments& args) {
  f.otherwise(
      Field{"rig", "folder with plan.toml or scenes/, e.g. rigs/paper, or a plan.toml"}.called(
          "RIG"),
      args.rig);
  f.otherwise({"out", "folder for the drapes and the tables; of a plan: for all its parts"},
              args.out);
  f.otherwise({"part", "I/N: every N-th case, starting with the I-th"}, args.part);
  fields(f, args.choice);
}

constexpr std::size_t kMostNamed = 20;  ///< cases named in the ending; study.csv has all

Ending ending_of(const std::vector<StudyOutcome>& outcomes) {
  std::array<int, std::size(names_of<CaseState>)> counts{};
  int resting = 0;
  Ending ending;
  for (const StudyOutcome& one : outcomes) {
    ++counts[static_cast<std::size_t>(one.state)];
    resting += one.at_rest ? 1 : 0;
    const bool named = one.state == CaseState::failed || one.state == CaseState::impossible ||
                       (one.state == CaseState::done && !one.at_rest);
    if (named && ending.rejected.size() < kMostNamed)
      ending.rejected.push_back(
          fmt::format("{}: {}{}", one.the_case.name(),
                      one.state == CaseState::impossible ? "cannot run: " : "", one.status));
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

/// Warnings about the fabrics of a study, without repetition; each case's certificate has its own.
std::vector<std::string> fabric_warnings(const StudyPlan& plan) {
  std::set<fs::path> fabrics;
  for (const StudyCase& one : plan.cases) fabrics.insert(one.fabric_file);
  std::vector<std::string> warnings;
  for (const fs::path& fabric : fabrics)
    for (const std::string& warning : read_fabric(fabric).warnings) warnings.push_back(warning);
  if (warnings.size() > kMostNamed) {
    const std::size_t more = warnings.size() - kMostNamed;
    warnings.resize(kMostNamed);
    warnings.push_back(fmt::format("{} more of such, in the certificates", more));
  }
  return warnings;
}

std::string study_words(const fs::path& plan, const fs::path& out) {
  return fmt::format("{} --out {}", shell_word(plan.string()), shell_word(out.string()));
}

int count(const StatusArguments& args, const CommonOptions& common) {
  const StudyPlan plan = read_plan(args.plan, {}, args.out, fs::read_symlink("/proc/self/exe"));
  const std::vector<StudyOutcome> outcomes = plan_status(plan);
  write_durable(args.out / "study.csv", study_csv(outcomes));
  Ending ending = ending_of(outcomes);
  ending.warnings = fabric_warnings(plan);
  ending.numbers.emplace_back("table", (args.out / "study.csv").string());
  if (!ending.go) ending.next_command = "drape study " + study_words(args.plan, args.out);
  return finish(ending, common);
}

/// Writes the tables of all cases of a rig, with a record of their own.
int finish_rig(const StudyArguments& args, const StudyPlan& plan,
               const std::vector<StudyOutcome>& outcomes, Ending ending,
               std::vector<std::string> words, const CommonOptions& common) {
  RunRecord record("drape-simulate", std::move(words), args.out / "study.run.json");
  const fs::path printed = plan.folder / "published.csv";
  const std::string tables =
      study_tables(outcomes, fs::exists(printed) ? std::optional(printed) : std::nullopt);
  write_durable(args.out / "study.csv", study_csv(outcomes));
  write_durable(args.out / "study.md", tables);
  for (const char* name : {"study.csv", "study.md"}) record.output(args.out / name);
  for (const StudyOutcome& one : outcomes)
    if (one.state == CaseState::done) record.input(one.the_case.folder / "sheet.json");
  ending.next_command = fmt::format("more {}", shell_word((args.out / "study.md").string()));
  if (!common.json && !common.quiet) fmt::print("{}\n", tables);
  return finish(ending, common, record);
}

int compute(const Command& app, const StudyArguments& args, std::vector<std::string> words,
            const CommonOptions& common) {
  if (args.rig.empty() || args.out.empty())
    throw usage_error("RIG or --out is missing", "give both, e.g. rigs/paper --out study");
  if (!fs::is_directory(args.rig))
    for (const char* option : {"--scenes", "--grids", "--spacings-mm", "--segments"})
      if (app.count(option) > 0)
        throw usage_error(fmt::format("{} cannot change a plan", option),
                          "write it into the plan file");
  const Part part = part_of(args.part);
  const StudyPlan plan =
      read_plan(args.rig, args.choice, args.out, fs::read_symlink("/proc/self/exe"));
  Progress progress("study", common.quiet);
  std::size_t ended = 0;
  const double all = std::max(1.0, static_cast<double>(plan.cases.size()) / part.count);
  const std::vector<StudyOutcome> outcomes =
      run_part(plan, part, args.out, thread_count(common), [&](const StudyOutcome& one) {
        progress.update(std::min(1.0, static_cast<double>(++ended) / all), one.the_case.name());
      });
  Ending ending = ending_of(outcomes);
  ending.warnings = fabric_warnings(plan);
  if (plan.by_name && part.count == 1)
    return finish_rig(args, plan, outcomes, std::move(ending), std::move(words), common);
  ending.next_command = "drape study status " + study_words(args.rig, args.out);
  return finish(ending, common);
}

}  // namespace

int study_command(int argc, char** argv) {
  Command app(
      "Drapes every scene of a rig or plan, on several meshes or, by the paper's model, "
      "grids.",
      "drape-simulate study");
  CommonOptions common;
  add_common_options(app, common);
  app.fallthrough();
  StudyArguments args;
  app.add_record(args);
  Command* status = app.add_subcommand(
      "status", "counts what of a plan is done, failed, missing or cannot run; writes study.csv");
  StatusArguments counted;
  status->add_record(counted);
  app.moved("--models", "a plan with model = \"paper\" asks for the paper's grids");
  app.moved("--solvers", "there is one way to rest");
  return run_program(app, argc, argv, common, [&] {
    if (app.chosen() != nullptr) return count(counted, common);
    return compute(app, args, arguments_of(argc, argv), common);
  });
}

}  // namespace drape::simulate
