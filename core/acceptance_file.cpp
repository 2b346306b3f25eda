// SPDX-License-Identifier: Apache-2.0
#include "core/acceptance_file.hpp"

namespace drape {

static void fields(Fields& f, AcceptanceRow& row) {
  f({"name", "figure of merit"}, row.name);
  f({"unit", "unit of value, uncertainty and limit"}, row.unit);
  f({"value", "measured value; null: not measured"}, row.value);
  f({"expanded_uncertainty", "expanded uncertainty of the value (95 %)"}, row.expanded);
  f({"limit", "maximum permissible value"}, row.limit);
  f.otherwise({"limit_stated", "true if an operator stated the limit"}, row.limit_stated);
  f({"smallest_fault", "smallest fault that the figure detects"}, row.smallest_fault);
  f({"smallest_fault_unit", "unit of smallest_fault"}, row.smallest_fault_unit);
  f({"where", "frame set or camera of the worst case"}, row.where);
  f({"go", "true if the value is within the limit"}, row.go);
  f({"not_measured", "reason why it was not measured"}, row.not_measured);
}

void fields(Fields& f, AcceptanceFile& acceptance) {
  f({"rig", "name of the rig"}, acceptance.rig);
  f({"calibration_sha256", "SHA-256 of the accepted calibration.json"},
    acceptance.calibration_sha256);
  f.limit(
      acceptance.calibration_sha256.size() == 64 &&
          acceptance.calibration_sha256.find_first_not_of("0123456789abcdef") == std::string::npos,
      "calibration_sha256", "this is no SHA-256", make_again);
  f({"date", "ISO date of the test, as the operator states it"}, acceptance.date);
  f({"valid_until", "ISO date"}, acceptance.valid_until);
  f({"positions", "positions of the artefact", 1, 0}, acceptance.positions);
  f({"go", "true if the instrument is accepted or its interim check passed"}, acceptance.go);
  f({"cause", "reason of a NO-GO"}, acceptance.cause);
  f.otherwise({"lacks", "missing parts of an acceptance; if any is missing it is an interim check"},
              acceptance.lacks);
  f.otherwise({"warnings", "warnings"}, acceptance.warnings);
  f({"figures", "figures of merit"}, acceptance.figures);
}

}  // namespace drape
