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

CertificateClaim claim_of(const SimulateResult& result, const SimulateOptions& options) {
  const SimulateReport& report = result.report;
  CertificateClaim claim;
  claim.at_rest = report.status == RestStatus::at_rest;
  claim.rows = options.rows;
  claim.cols = options.cols;
  claim.segments = options.segments;
  claim.reach = options.reach;
  claim.model = options.model;
  claim.paper_mass = options.mass == MassRule::paper;
  claim.residual = report.residual;
  claim.residual_tolerance = report.residual_tolerance;
  claim.warp_least = report.strains.warp_least;
  claim.warp_most = report.strains.warp_most;
  claim.weft_least = report.strains.weft_least;
  claim.weft_most = report.strains.weft_most;
  claim.least_gap_object_m = report.least_gap_object_m;
  claim.deepest_between_m = report.deepest_between_m;
  claim.penetration_tolerance_m = report.penetration_tolerance_m;
  claim.cloth_thickness_m = report.cloth_thickness_m;
  claim.memory = result.memory;
  claim.contact_forces = result.contact_forces;
  if (!result.history.empty()) {
    const HistoryRow& last = result.history.back();
    claim.gravity_j = last.gravity_j;
    claim.stretch_j = last.stretch_j;
    claim.shear_j = last.shear_j;
    claim.bending_j = last.bending_j;
    claim.twist_j = last.twist_j;
  }
  return claim;
}

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
