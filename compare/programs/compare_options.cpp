// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/compare_options.hpp"

#include "core/program/command.hpp"

namespace drape::compare {

void add_compare_options(Command& app, CompareArguments& arguments) {
  app.add_option(
         "SHEET", arguments.sheets,
         "sheet.ply or .json; each measured one opens a group of the simulated ones after it "
         "(before any: compared with each other); .toml: another simulator's mesh")
      ->required();
  app.add_option("--calibration", arguments.calibration,
                 "calibration.json: draws the virtual cloth into the photographs");
  app.add_option("--acceptance", arguments.acceptance,
                 "acceptance.json of the rig, to keep in the store: NO-GO where it is so for this "
                 "calibration, a warning where it is out of date");
  app.add_option("--warning", arguments.warnings,
                 "what a stage before warned of, to keep in report and store")
      ->one_per_flag();
  app.add_option("--no-go", arguments.not_compared,
                 "why the bench is NO-GO beside what is compared, to keep in report and store")
      ->one_per_flag();
  app.add_option("--store", arguments.store, "results store to add to (made when absent)");
  app.add_option("--report", arguments.report, "report.html to write, its pictures beside it");
  app.add_option("--label", arguments.label.label, "name of the run in the store");
  app.add_option("--operator", arguments.label.operator_name, "who ran it");
  app.add_option("--repeat", arguments.repeats,
                 "measured sheet of a drape that was laid again: the match rests on three or more")
      ->one_per_flag();
  app.add_option("--significance", arguments.options.significance,
                 "part of real repeats that count as outside of the others")
      ->capture_default_str();
  app.add_option("--sensitivity", arguments.sensitivities,
                 "sensitivity.json that must lie beside a measured sheet")
      ->one_per_flag();
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

}  // namespace drape::compare
