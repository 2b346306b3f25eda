// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/programs/commands.hpp"
#include "compare/report/account.hpp"
#include "compare/report/report.hpp"
#include "compare/store/outcome.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/run_report.hpp"
#include "core/units.hpp"

namespace drape::compare {

namespace {

/// Arguments of `drape compare`.
struct CompareArguments {
  std::vector<std::filesystem::path> sheets;
  std::filesystem::path calibration, store, report, acceptance;
  std::vector<std::filesystem::path> sensitivities, repeats;
  std::vector<std::string> warnings, not_compared;
  RunLabel label;
  Options options;
};

void fields(Fields& f, CompareArguments& a) {
  f(Field{"sheet",
          "sheet.ply or .json; each measured one starts a group with the simulated ones after it "
          "(those before any are compared with each other); .toml: mesh of another simulator"}
        .called("SHEET"),
    a.sheets);
  f.otherwise({"calibration", "calibration.json: draws the virtual cloth into the photographs"},
              a.calibration);
  f.otherwise({"acceptance",
               "acceptance.json of the rig, kept in the store: NO-GO if it is NO-GO for this "
               "calibration, a warning if it is out of date"},
              a.acceptance);
  f.otherwise(Field{"warning", "warning of an earlier stage, kept in report and store"}.per_flag(),
              a.warnings);
  f.otherwise(
      Field{"no_go", "further reason why the bench is NO-GO, kept in report and store"}.per_flag(),
      a.not_compared);
  f.otherwise({"store", "results store to add to (created if absent)"}, a.store);
  f.otherwise({"report", "report.html to write, with its pictures beside it"}, a.report);
  f.otherwise({"label", "name of the run in the store"}, a.label.label);
  f.otherwise({"operator", "name of the operator"}, a.label.operator_name);
  f.otherwise(Field{"repeat",
                    "measured sheet of another laying of a drape: the match is based on them if "
                    "there are three or more"}
                  .per_flag(),
              a.repeats);
  f.otherwise({"significance", "fraction of real repeats that count as outside the others", 1,
               above_zero, 1},
              a.options.significance);
  f({"tolerance_mm",
     "limit of the mean distance for the match if the drape was laid fewer than three times; "
     "default: none, and no match",
     units::mm, above_zero},
    a.options.tolerance_m);
  f.otherwise(
      Field{"sensitivity", "sensitivity.json that must lie beside a simulated sheet"}.per_flag(),
      a.sensitivities);
  f.otherwise({"min_marks", "NO-GO below this number of compared marks", 1, 1},
              a.options.min_marks);
  f.otherwise({"max_sigma_percent",
               "NO-GO if the median uncertainty of a mark exceeds this percentage of the best mean "
               "distance",
               units::percent, above_zero},
              a.options.max_sigma_ratio);
  f.otherwise({"accept_unsettled", "warn instead of NO-GO if a simulation is not at rest"},
              a.options.accept_unsettled);
}

/// Ending to keep in the run record.
Ending ending_of(const RunReport& report, const Outcome& outcome) {
  Ending ending;
  ending.go = report.go;
  ending.verdict = report.sentence;
  for (const ReportedDrape& drape : report.drapes) {
    const DistanceFigures shown = figures_of(drape);
    if (!shown.mean.empty())
      ending.numbers.emplace_back(
          drape.label, fmt::format("{} mm apart, U {} mm, {}", shown.mean, shown.expanded,
                                   drape::name_of(drape.match.match)));
  }
  if (outcome.stored)
    ending.numbers.emplace_back(
        "store",
        fmt::format("{}: run {}, {} comparisons added, {} were there already", outcome.store,
                    outcome.run, outcome.stored->added, outcome.stored->present));
  if (!outcome.report.empty()) ending.numbers.emplace_back("report", outcome.report);
  ending.rejected = outcome.not_compared;
  ending.warnings = outcome.warnings;
  for (std::size_t i = 1; i < report.reasons.size(); ++i)
    ending.warnings.push_back("NO-GO also because " + report.reasons[i]);
  if (!outcome.store.empty())
    ending.next_command = fmt::format("drape results {} --store {}",
                                      report.run ? fmt::format("show {}", *report.run) : "tables",
                                      shell_word(outcome.store));
  return ending;
}

/// Prints the ending as text, or report.json with the keys of the ending; returns the exit code.
int print_ending(const RunReport& report, const Ending& ending, const CommonOptions& common) {
  if (common.json) {
    Value all = value_of(report);
    const Value end = value_of(ending);
    for (const auto& [key, value] : *end.get_if<Value::Table>())
      if (all.find(key) == nullptr) all[key] = value;
    print_text(pretty(all));
  } else if (!common.quiet) {
    std::string page;
    for (const auto& [name, value] : ending.numbers)
      if (name == "report") page = value;
    print_text(printable(ending_text(report, first_line(report), page)));
    if (!ending.next_command.empty())
      print_text("next    " + printable(ending.next_command) + "\n");
  }
  return ending.go ? 0 : 1;
}

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
