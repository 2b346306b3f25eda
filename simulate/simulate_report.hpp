// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/sheet.hpp"
#include "simulate/cloth/cloth.hpp"
#include "simulate/objects/contact_forces.hpp"

namespace drape::simulate {

/// One row of history.csv.
struct HistoryRow {
  double time_s = 0, kinetic_j = 0, gravity_j = 0, stretch_j = 0, shear_j = 0, bending_j = 0,
         twist_j = 0, contact_j = 0, residual = 0;
  int contacts = 0;
};

/// How well one Kawabata curve is approximated.
struct CurveReport {
  std::string name;        ///< e.g. "tensile warp"
  std::string unit;        ///< of the errors: "gf/cm" or "gf cm/cm"
  int segments = 0;        ///< distinct slopes used
  double first_slope = 0;  ///< SI: N/m, N/(m rad) or N m
  double range = 0;        ///< SI: strain, rad or 1/m
  double rms_error = 0;    ///< SI: N/m or N
  double largest_error = 0;
  double half_hysteresis = 0;  ///< SI; what merging the two branches hides
};

/// `penetrates`: still, but deeper in an object or through itself than the tolerances allow.
/// `refused`: still, but the independent checker does not accept it, see judge_rest().
enum class RestStatus { at_rest, step_limit, diverged, penetrates, refused };

/// What the independent checker (certify()) says of a sheet that is called at rest.
struct CheckReport {
  bool accepted = false;
  double residual = 0;  ///< of a particle's weight, with the contact forces it found
  int places = 0;       ///< where the sheet may press on something
  std::vector<std::string> refused;
};

struct SimulateReport {
  RestStatus status = RestStatus::step_limit;
  std::string sentence;  ///< "at rest", or why not
  long steps = 0;
  int backtracked_steps = 0;
  int kinetic_stops = 0;
  double time_s = 0;  ///< simulated
  double step_least_s = 0, step_most_s = 0;
  /// Largest net static force on any particle with damping off and contact, friction and pin
  /// reactions in, over the weight of the mean particle.
  double residual = 0;
  double residual_rms = 0;
  double residual_tolerance = 0;
  double kinetic_j = 0;  ///< at the end
  Cloth::Strains strains;
  int contacts = 0;                          ///< particles touching
  int contacts_between = 0;                  ///< line pieces and cells watched between particles
  int contacts_pairs = 0;                    ///< pressing pairs, see PairContacts
  std::optional<double> least_gap_object_m;  ///< of any particle; absent without objects
  double least_gap_table_m = 0;
  double penetration_tolerance_m = 0;  ///< that was applied between particles
  double deepest_between_m = 0;  ///< of the sheet between particles inside an object, 0 for none
  std::optional<double> least_self_distance_m;  ///< absent: no nearer than a grid spacing
  double cloth_thickness_m = 0;                 ///< that layers were kept apart
  int self_crossings = 0;                       ///< pairs of triangles, see self_distance
  double energy_start_j = 0, energy_end_j = 0;  ///< gravity, elastic and kinetic
  double lost_viscous_j = 0;                    ///< to damping and air
  double lost_kinetic_stops_j = 0;
  std::optional<double> lost_internal_friction_j;  ///< absent: the option was off
  double pierced_m = 0;         ///< of an object's edge or rim through the sheet, see piercing.hpp
  double deepest_edge_m = 0;    ///< of an object's edge or corner that presses into the sheet
  double found_contacts_j = 0;  ///< brought in where a contact was found already pressed
  double hold_error_m = 0;      ///< of the pins at the end
  std::vector<CurveReport> curves;
  double twist_n_m = 0;
  /// Of a round specimen on one upright cylinder: (shadow - disc) / (specimen - disc), Cusick 1968.
  std::optional<double> drape_coefficient;
  int clamped_springs = 0;  ///< model "paper": springs whose K'st is held at 0 in the end
  double placed_yaw_rad = 0;
  Eigen::Vector3d placed_centre_in_world = Eigen::Vector3d::Zero();
  int placed_by_marks = 0;
  double placement_rms_mm = 0;
  std::optional<CheckReport> check;  ///< absent: not checked
  std::vector<std::string> warnings;
};

struct SimulateResult {
  Sheet sheet;
  std::vector<HistoryRow> history;
  SimulateReport report;
  std::optional<ClothMemory> memory;  ///< with internal friction: of the sheet as it ends
  /// Of the sheet as it ends, from the static solver; empty where nothing presses or motion ended.
  std::vector<ContactForce> contact_forces;
};

}  // namespace drape::simulate
