// SPDX-License-Identifier: Apache-2.0
#include "compare/history/acceptance.hpp"
#include "compare/programs/commands.hpp"
#include "compare/programs/compare_options.hpp"
#include "compare/programs/ending.hpp"
#include "compare/report/account.hpp"
#include "compare/report/report.hpp"
#include "compare/store/runs.hpp"
#include "core/error.hpp"
#include "core/program/command.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {

namespace {

/// Records a sensitivity file even if it was left out, since it would be used once made again.
void record_sensitivity(const std::filesystem::path& file, const Session& session,
                        RunRecord& record) {
  for (const auto& [read, sha256] : session.read)
    if (read == file) return;
  record.input(file);
  for (const DrapeFiles& drape : session.drapes)
    for (const Simulation& one : drape.input.simulations)
      if (equivalent(absolute(file).parent_path(), absolute(one.sheet.file).parent_path())) return;
  throw bad_input("the simulation of this sensitivity.json is not given", {.file = file.string()},
                  "give the sheet.ply that it lies beside, or leave it out");
}

int run_compare(CompareArguments& arguments, const std::vector<std::string>& command,
                const CommonOptions& common) {
  const auto& primary = arguments.report.empty() ? arguments.store : arguments.report;
  RunRecord record("drape-compare", command,
                   primary.empty() ? std::filesystem::path() : run_record_path(primary));
  Progress progress("compare", common.quiet || common.json);
  progress.update(0, "reading sheets");
  const Session session = read_session(arguments.sheets, arguments.calibration, arguments.repeats);
  for (const auto& [file, sha256] : session.read) record.input(file, sha256);
  for (const auto& file : arguments.sensitivities) record_sensitivity(file, session, record);
  Outcome outcome;
  outcome.warnings = arguments.warnings;
  outcome.not_compared = arguments.not_compared;
  outcome.warnings.insert(outcome.warnings.end(), session.warnings.begin(), session.warnings.end());
  outcome.arguments = command;
  outcome.store = arguments.store.string();
  outcome.report = arguments.report.string();
  // Completes a store whose creation was interrupted, which a reader would refuse.
  if (std::filesystem::is_regular_file(arguments.store)) Store(arguments.store).close();
  const auto acceptance = look_at_acceptance(arguments.acceptance, session, outcome, record);
  compare_session(session, arguments.options, outcome);
  progress.update(0.3, "storing");
  if (!arguments.store.empty()) {
    if (acceptance) store_acceptance(arguments.store, *acceptance);
    outcome.stored = import_session(arguments.store, session, outcome, arguments.label);
    record.output(arguments.store);
  }
  progress.update(0.6, "writing the report");
  const std::filesystem::path folder = arguments.report.parent_path();
  const RunReport account = account_of(session, outcome, folder.empty() ? "." : folder);
  if (!arguments.report.empty()) {
    for (const auto& file : write_report(arguments.report, account)) record.output(file);
  }
  progress.update(1, "done");
  const Ending ending = ending_of(account, outcome);
  record.write(outcome.go() ? 0 : 1, ending);
  return print_ending(account, ending, common);
}

}  // namespace

int compare_command(int argc, char** argv) {
  return run_command<CompareArguments>(
      argc, argv, "drape-compare",
      "Measures the distance between real and virtual drapes, stores and reports it.", run_compare);
}

}  // namespace drape::compare

int main(int argc, char** argv) {
  using namespace drape::compare;
  return drape::run_stage(
      argc, argv, compare_command,
      {{"repeats", repeats_command, "is a virtual sheet inside the repeats of the real one?"},
       {"drapemeter", drapemeter_command, "drape coefficient, nodes and Fourier orders of hems"}});
}
