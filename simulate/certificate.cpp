// SPDX-License-Identifier: Apache-2.0
#include "core/files/json_file.hpp"
#include "core/units.hpp"
#include "simulate/fabric/csv_text.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {
namespace {

using units::deg;
using units::mm;
using units::percent;

constexpr double kMicro = 1e-6;

Json curves_json(const SimulateReport& report) {
  Json list = Json::array();
  for (const CurveReport& curve : report.curves) {
    const double unit = curve.unit == "gf/cm" ? units::gf_per_cm : units::gf_cm_per_cm;
    const std::string suffix = curve.unit == "gf/cm" ? "gf_per_cm" : "gf_cm_per_cm";
    Json json;
    json["curve"] = curve.name;
    json["segments_used"] = curve.segments;
    json["fit_rms_error_" + suffix] = curve.rms_error / unit;
    json["fit_largest_error_" + suffix] = curve.largest_error / unit;
    json["half_hysteresis_" + suffix] = curve.half_hysteresis / unit;
    if (curve.name.starts_with("tensile")) {
      json["first_slope_n_per_m"] = curve.first_slope;
      json["fit_range_percent"] = curve.range / percent;
    } else if (curve.name.starts_with("shear")) {
      json["first_slope_gf_per_cm_deg"] = curve.first_slope / units::gf_per_cm_deg;
      json["fit_range_deg"] = curve.range / deg;
    } else {
      json["first_slope_gf_cm2_per_cm"] = curve.first_slope / units::gf_cm2_per_cm;
      json["fit_range_per_cm"] = curve.range / units::per_cm;
    }
    list.push_back(json);
  }
  return list;
}

Json energy_json(const SimulateReport& report) {
  Json json;
  json["start_uJ"] = report.energy_start_j / kMicro;
  json["end_uJ"] = report.energy_end_j / kMicro;
  json["lost_to_damping_and_air_uJ"] = report.lost_viscous_j / kMicro;
  json["lost_to_kinetic_stops_uJ"] = report.lost_kinetic_stops_j / kMicro;
  json["brought_in_by_contact_search_uJ"] = report.found_contacts_j / kMicro;
  if (report.lost_internal_friction_j)
    json["lost_to_internal_friction_uJ"] = *report.lost_internal_friction_j / kMicro;
  json["lost_to_impact_friction_and_springs_uJ"] =
      (report.energy_start_j + report.found_contacts_j - report.energy_end_j -
       report.lost_viscous_j - report.lost_kinetic_stops_j -
       report.lost_internal_friction_j.value_or(0)) /
      kMicro;
  return json;
}

Json strain_json(const Cloth::Strains& strains) {
  Json json;
  json["warp_percent"] = {strains.warp_least / percent, strains.warp_most / percent};
  json["weft_percent"] = {strains.weft_least / percent, strains.weft_most / percent};
  json["largest_shear_deg"] = strains.shear_most_rad / deg;
  json["largest_curvature_per_cm"] = strains.curvature_most_per_m / units::per_cm;
  return json;
}

Json distance_json(const SimulateResult& result) {
  const SimulateReport& report = result.report;
  Json json;
  json["least_particle_to_object_mm"] =
      report.least_gap_object_m ? Json(*report.least_gap_object_m / mm) : Json();
  json["least_particle_to_table_mm"] = report.least_gap_table_m / mm;
  json["deepest_between_particles_mm"] = report.deepest_between_m / mm;
  json["least_to_itself_mm"] =
      report.least_self_distance_m ? Json(*report.least_self_distance_m / mm) : Json();
  json["triangles_through_itself"] = report.self_crossings;
  json["deepest_edge_of_an_object_pressing_mm"] = report.deepest_edge_m / mm;
  json["edge_of_an_object_through_the_sheet_mm"] = report.pierced_m / mm;
  json["particles_touching"] = report.contacts;
  if (!result.contact_forces.empty()) json["contact_forces_stated"] = result.contact_forces.size();
  json["contacts_between_particles"] = report.contacts_between;
  json["pressing_pairs_of_features"] = report.contacts_pairs;
  json["largest_pin_error_mm"] = report.hold_error_m / mm;
  return json;
}

Json check_json(const SimulateReport& report) {
  if (!report.check) return {};
  Json json;
  json["accepted"] = report.check->accepted;
  json["largest_residual_per_particle_weight"] = report.check->residual;
  json["places_that_may_press"] = report.check->places;
  json["refused"] = report.check->refused;
  return json;
}

Json start_json(const SimulateReport& report) {
  Json json;
  json["centre_mm"] = to_json_vector(report.placed_centre_in_world / mm);
  json["yaw_deg"] = report.placed_yaw_rad / deg;
  json["placed_by_marks"] = report.placed_by_marks;
  json["placement_rms_mm"] = report.placement_rms_mm;
  return json;
}

Json options_json(const SimulateOptions& options, const SimulateReport& report) {
  Json json;
  json["rows"] = options.rows;
  json["cols"] = options.cols;
  json["round_specimen"] = options.round;
  json["segments"] = options.segments;
  if (const auto& reach = options.reach) {
    Json& fitted = json["curves_fitted_up_to"];
    fitted["strain_percent"] = {reach->tensile[0] / percent, reach->tensile[1] / percent};
    fitted["shear_deg"] = reach->shear_rad / deg;
    fitted["curvature_per_cm"] = reach->curvature_per_m / units::per_cm;
  }
  json["model"] = drape::name_of(options.model);
  json["solver"] = drape::name_of(options.solver);
  json["mass"] =
      options.mass == MassRule::area && options.model != ClothModel::paper ? "area" : "paper";
  json["damping_per_s"] = options.damping_per_s;
  json["air_drag_kg_per_m3"] = options.air_drag_kg_per_m3;
  json["spring_damping_ratio"] = options.spring_damping_ratio;
  json["natural_time_s"] = options.natural_time_s;
  json["kinetic_damping"] = options.kinetic_damping;
  json["imperfection_um"] = options.imperfection_m / units::um;
  json["step_share"] = options.step_fraction;
  json["max_steps"] = options.max_steps;
  if (options.internal_friction) json["internal_friction"] = true;
  json["contact_between_particles"] = options.contact_between_particles;
  json["penetration_tolerance_mm"] = report.penetration_tolerance_m / mm;
  json["cloth_thickness_mm"] = report.cloth_thickness_m / mm;
  return json;
}

}  // namespace

std::string history_csv(const std::vector<HistoryRow>& history) {
  const std::vector<std::string> names = history_columns();
  std::vector<std::vector<double>> columns(names.size());
  for (const HistoryRow& row : history) {
    const double values[] = {row.time_s,
                             row.kinetic_j / kMicro,
                             row.gravity_j / kMicro,
                             row.stretch_j / kMicro,
                             row.shear_j / kMicro,
                             row.bending_j / kMicro,
                             row.twist_j / kMicro,
                             row.contact_j / kMicro,
                             row.residual,
                             static_cast<double>(row.contacts)};
    for (std::size_t i = 0; i < names.size(); ++i) columns[i].push_back(values[i]);
  }
  return csv_text(names, columns);
}

void write_certificate(const std::filesystem::path& file, const SimulateResult& result,
                       const SimulateOptions& options) {
  const SimulateReport& report = result.report;
  Json json;
  json["schema"] = "drapebench/certificate/1";
  json["at_rest"] = report.status == RestStatus::at_rest;
  json["status"] = report.sentence;
  json["largest_residual_per_particle_weight"] = report.residual;
  json["rms_residual_per_particle_weight"] = report.residual_rms;
  json["residual_tolerance"] = report.residual_tolerance;
  json["independent_check"] = check_json(report);
  json["kinetic_energy_uJ"] = report.kinetic_j / kMicro;
  json["simulated_time_s"] = report.time_s;
  json["steps"] = report.steps;
  json["steps_cut_at_an_impact"] = report.backtracked_steps;
  json["kinetic_stops"] = report.kinetic_stops;
  json["step_us"] = {report.step_least_s * 1e6, report.step_most_s * 1e6};
  json["strain"] = strain_json(report.strains);
  json["distance"] = distance_json(result);
  json["energy"] = energy_json(report);
  json["start"] = start_json(report);
  json["twist_stiffness_uNm"] = report.twist_n_m / kMicro;
  if (options.model == ClothModel::paper)
    json["springs_with_k_st_clamped_at_0"] = report.clamped_springs;
  if (report.drape_coefficient)
    json["drape_coefficient_percent"] = *report.drape_coefficient / percent;
  json["curves"] = curves_json(report);
  json["options"] = options_json(options, report);
  json["warnings"] = report.warnings;
  write_json(file, json);
}

}  // namespace drape::simulate
