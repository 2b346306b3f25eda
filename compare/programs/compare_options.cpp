// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/compare_options.hpp"

#include "core/units.hpp"

namespace drape::compare {

void fields(Fields& f, CompareArguments& a) {
  f(Field{"sheet",
          "sheet.ply or .json; each measured one opens a group of the simulated ones after it "
          "(before any: compared with each other); .toml: another simulator's mesh"}
        .called("SHEET"),
    a.sheets);
  f.otherwise({"calibration", "calibration.json: draws the virtual cloth into the photographs"},
              a.calibration);
  f.otherwise({"acceptance",
               "acceptance.json of the rig, to keep in the store: NO-GO where it is so for this "
               "calibration, a warning where it is out of date"},
              a.acceptance);
  f.otherwise(
      Field{"warning", "a warning of a stage before, to keep in report and store"}.per_flag(),
      a.warnings);
  f.otherwise(
      Field{"no_go", "why the bench is NO-GO beside what is compared, to keep in report and store"}
          .per_flag(),
      a.not_compared);
  f.otherwise({"store", "results store to add to (made when absent)"}, a.store);
  f.otherwise({"report", "report.html to write, its pictures beside it"}, a.report);
  f.otherwise({"label", "name of the run in the store"}, a.label.label);
  f.otherwise({"operator", "who ran it"}, a.label.operator_name);
  f.otherwise(Field{"repeat",
                    "measured sheet of a drape that was laid again: the match rests on three or "
                    "more"}
                  .per_flag(),
              a.repeats);
  f.otherwise({"significance", "part of real repeats that count as outside of the others", 1,
               above_zero, 1},
              a.options.significance);
  f({"tolerance_mm",
     "limit of the mean distance that the match is judged against where the drape was laid fewer "
     "than three times; default: none, and no match",
     units::mm, above_zero},
    a.options.tolerance_m);
  f.otherwise(
      Field{"sensitivity", "sensitivity.json that must lie beside a simulated sheet"}.per_flag(),
      a.sensitivities);
  f.otherwise({"min_marks", "NO-GO below this number of compared marks", 1, 1},
              a.options.min_marks);
  f.otherwise({"max_sigma_percent",
               "NO-GO when the median uncertainty of a mark is above this part of the best mean "
               "distance",
               units::percent, above_zero},
              a.options.max_sigma_ratio);
  f.otherwise({"accept_unsettled", "a simulation that is not at rest is a warning, not NO-GO"},
              a.options.accept_unsettled);
}

}  // namespace drape::compare
