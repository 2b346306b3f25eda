// SPDX-License-Identifier: Apache-2.0
#include "compare/history/seal.hpp"
#include "compare/programs/ending.hpp"
#include "compare/report/report.hpp"
#include "core/program/command.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"

using namespace drape;
using namespace drape::compare;

namespace {

struct Arguments {
  std::vector<std::filesystem::path> sheets;
  std::filesystem::path calibration, store, report;
  double max_sigma_percent = 10;
  Options options;
};

void add_options(Command& app, Arguments& arguments) {
  app.add_option("SHEET", arguments.sheets,
                 "sheet.ply or sheet.json; each measured one opens a group, the simulated ones "
                 "after it belong to it (before any measured one: compared with each other only); "
                 "a .toml describes another simulator's mesh")
      ->required();
  app.add_option("--calibration", arguments.calibration,
                 "calibration.json: draws the virtual cloth into the photographs");
  app.add_option("--store", arguments.store, "results store to add to (made when absent)");
  app.add_option("--report", arguments.report, "report.html to write, with its pictures beside it");
  app.add_option("--min-marks", arguments.options.min_marks,
                 "NO-GO below this number of compared marks (default 10)");
  app.add_option("--max-sigma-percent", arguments.max_sigma_percent,
                 "NO-GO when the median uncertainty of a mark is above this part of the best mean "
                 "distance (default 10 %)");
  app.add_flag("--accept-unsettled", arguments.options.accept_unsettled,
               "a simulation that is not at rest is a warning, not NO-GO");
  app.add_flag("--accept-penetration", arguments.options.accept_penetration,
               "penetration stated by a simulation is a warning, not NO-GO");
}

int run(Arguments& arguments, const CommonOptions& common,
        const std::vector<std::string>& command) {
  RunRecord record("drape-compare", command);
  arguments.options.max_sigma_ratio = arguments.max_sigma_percent / 100;
  arguments.options.check();
  Progress progress("compare", common.quiet || common.json);
  progress.update(0, "reading sheets");
  const Session session = read_session(arguments.sheets, arguments.calibration);
  for (const auto& [file, sha256] : session.read) record.input(file, sha256);
  Outcome outcome;
  outcome.warnings = session.warnings;
  outcome.store = arguments.store.string();
  outcome.report = arguments.report.string();
  outcome.arguments = command;
  compare_session(session, arguments.options, outcome);
  progress.update(0.3, "storing");
  if (!arguments.store.empty()) {
    outcome.stored = import_session(arguments.store, session, outcome);
    record.output(arguments.store);
  }
  progress.update(0.6, "writing the report");
  if (!arguments.report.empty()) {
    for (const auto& file : write_report(arguments.report, session, outcome)) record.output(file);
  }
  progress.update(1, "done");
  const int code = outcome.go() ? 0 : 1;
  const auto& primary = arguments.report.empty() ? arguments.store : arguments.report;
  if (!primary.empty()) record.write(run_record_path(primary), code);
  if (!arguments.store.empty()) {
    std::vector<std::filesystem::path> files = files_of(session);
    if (!arguments.report.empty()) files.push_back(arguments.report);
    seal_store(arguments.store, files);
  }
  return print_ending(session, outcome, common);
}

}  // namespace

int main(int argc, char** argv) {
  Command app("Measures the distance between real and virtual drapes, stores and reports it.",
              "drape-compare");
  CommonOptions common;
  Arguments arguments;
  add_common_options(app, common);
  add_options(app, arguments);
  return run_program(app, argc, argv, common,
                     [&] { return run(arguments, common, arguments_of(argc, argv)); });
}
