// SPDX-License-Identifier: Apache-2.0
// What a run claims, from memory and from its files, and its judgement.
#include <fmt/format.h>

#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"
#include "simulate/checker/certify.hpp"

namespace drape::simulate {
namespace {

constexpr double kMicro = 1e-6;

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

std::vector<ContactForce> read_stated(const std::filesystem::path& file, int stated) {
  std::vector<ContactForce> forces = read_contact_forces(file);
  if (forces.size() != static_cast<std::size_t>(stated))
    throw bad_input(
        fmt::format("{} contact forces, where the certificate states {}", forces.size(), stated),
        {.file = file.string()}, "simulate again");
  return forces;
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
  claim.shear_most_rad = report.strains.shear_most_rad;
  claim.curvature_most_per_m = report.strains.curvature_most_per_m;
  claim.twist_n_m = report.twist_n_m;
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

CertificateClaim read_claim(const std::filesystem::path& folder) {
  using units::mm;
  using units::percent;
  const JsonNode root = JsonNode::open(folder / "certificate.json", "certificate", 1);
  const JsonNode options = root.at("options");
  const JsonNode strain = root.at("strain");
  const JsonNode distance = root.at("distance");
  CertificateClaim claim;
  claim.at_rest = root.boolean("at_rest");
  claim.rows = options.integer("rows");
  claim.cols = options.integer("cols");
  claim.segments = options.integer("segments");
  if (options.has("curves_fitted_up_to")) {
    const JsonNode reach = options.at("curves_fitted_up_to");
    const Eigen::Vector2d tensile = reach.vector2("strain_percent") * percent;
    claim.reach = {.tensile = {tensile[0], tensile[1]},
                   .shear_rad = reach.number("shear_deg") * units::deg,
                   .curvature_per_m = reach.number("curvature_per_cm") * units::per_cm};
  }
  claim.model = options.text("model");
  claim.paper_mass = options.text("mass") == "paper";
  claim.residual = root.number("largest_residual_per_particle_weight");
  claim.residual_tolerance = root.number("residual_tolerance");
  const Eigen::Vector2d warp = strain.vector2("warp_percent") * percent;
  const Eigen::Vector2d weft = strain.vector2("weft_percent") * percent;
  claim.warp_least = warp[0];
  claim.warp_most = warp[1];
  claim.weft_least = weft[0];
  claim.weft_most = weft[1];
  if (const auto shear = strain.optional_number("largest_shear_deg"))
    claim.shear_most_rad = *shear * units::deg;
  if (const auto curvature = strain.optional_number("largest_curvature_per_cm"))
    claim.curvature_most_per_m = *curvature * units::per_cm;
  if (const auto twist = root.optional_number("twist_stiffness_uNm"))
    claim.twist_n_m = *twist * kMicro;
  if (const auto gap = distance.optional_number("least_particle_to_object_mm"))
    claim.least_gap_object_m = *gap * mm;
  claim.deepest_between_m = distance.number("deepest_between_particles_mm") * mm;
  // Certificates of before these were options.
  claim.penetration_tolerance_m =
      options.optional_number("penetration_tolerance_mm").value_or(0.5) * mm;
  claim.cloth_thickness_m = options.optional_number("cloth_thickness_mm").value_or(0) * mm;
  if (options.has("internal_friction") && options.boolean("internal_friction"))
    claim.memory = read_memory(folder / "memory.csv");
  if (const int stated = distance.optional_integer("contact_forces_stated").value_or(0); stated > 0)
    claim.contact_forces = read_stated(folder / "contact_forces.csv", stated);
  const Csv history = read_csv(folder / "history.csv", history_columns());
  if (!history.lines.empty()) {
    claim.gravity_j = history.columns[2].back() * kMicro;
    claim.stretch_j = history.columns[3].back() * kMicro;
    claim.shear_j = history.columns[4].back() * kMicro;
    claim.bending_j = history.columns[5].back() * kMicro;
    claim.twist_j = history.columns[6].back() * kMicro;
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
