// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "simulate/checker/certify.hpp"

namespace drape::simulate {
namespace {

CheckReport check_of(const CertifyReport& judged) {
  CheckReport check;
  check.accepted = judged.accepted();
  check.residual = judged.residual;
  check.places = judged.contacts;
  check.refused = judged.refusals;
  for (const CertifyLine& line : judged.lines) {
    if (line.passes()) continue;
    check.refused.push_back(
        line.is_limit
            ? fmt::format("{}: {:.3g}, at most {:.3g}", line.what, line.found, line.allowed)
            : fmt::format("{}: {:.9g}, stated {:.9g}", line.what, line.found, line.claimed));
  }
  return check;
}

}  // namespace

void judge_rest(SimulateResult& result, const Scene& scene, const Fabric& fabric,
                const Print& print, const SimulateOptions& options) {
  SimulateReport& report = result.report;
  if (report.status != RestStatus::at_rest || options.round) return;
  report.check = check_of(certify(result.sheet, scene, fabric, print, claim_of(result, options)));
  if (report.check->accepted) return;
  report.status = RestStatus::refused;
  report.sentence = "still, but refused by the checker: " + report.check->refused.front();
  std::get<SimulatedSource>(result.sheet.source).status = report.sentence;
}

}  // namespace drape::simulate
