// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/compare_options.hpp"

#include "core/units.hpp"

namespace drape::compare {

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

}  // namespace drape::compare
