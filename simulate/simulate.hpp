// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/cloth/cloth.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/objects/contact_forces.hpp"

namespace drape::simulate {

/// One row of history.csv.
struct HistoryRow {
  double time_s = 0, kinetic_j = 0, gravity_j = 0, stretch_j = 0, shear_j = 0, bending_j = 0,
         twist_j = 0, contact_j = 0, residual = 0;
  int contacts = 0;
};

/// Approximation of one Kawabata curve.
struct CurveReport {
  std::string name;        ///< e.g. "tensile warp"
  std::string unit;        ///< unit of the errors: "gf/cm" or "gf cm/cm"
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

/// Judgement of the independent checker (certify()) on a sheet that is called at rest.
struct CheckReport {
  bool accepted = false;
  double residual = 0;  ///< in weights of a particle, with the contact forces it found
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
  std::optional<double> least_gap_object_m;  ///< least of any particle; absent without objects
  double least_gap_table_m = 0;
  double penetration_tolerance_m = 0;           ///< that was applied between particles
  double deepest_between_m = 0;                 ///< between particles inside an object, 0 for none
  std::optional<double> least_self_distance_m;  ///< absent: no nearer than a grid spacing
  double cloth_thickness_m = 0;                 ///< that layers were kept apart
  int self_crossings = 0;                       ///< pairs of triangles, see self_distance
  double energy_start_j = 0, energy_end_j = 0;  ///< gravity, elastic and kinetic
  double lost_viscous_j = 0;                    ///< to damping and air
  double lost_kinetic_stops_j = 0;
  std::optional<double> lost_internal_friction_j;  ///< absent: the option was off
  double pierced_m = 0;  ///< height of an object's edge or rim through the sheet, see piercing.hpp
  double deepest_edge_m = 0;    ///< depth of an object's edge or corner that presses into the sheet
  double found_contacts_j = 0;  ///< brought in where a contact was found already pressed
  double hold_error_m = 0;      ///< largest error of the pins at the end
  std::vector<CurveReport> curves;
  double twist_n_m = 0;
  /// Drape coefficient of a round specimen on one upright cylinder: (shadow - disc) / (specimen -
  /// disc), Cusick 1968.
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
  /// Contact forces of the sheet as it ends, from the static solver; empty where nothing presses or
  /// motion ended.
  std::vector<ContactForce> contact_forces;
};

/// `rk4`: motion with damping; `newton`: Newton's method; `fall`: motion by implicit steps, then
/// it.
enum class Solver { rk4, newton, fall };

/// Options of a simulation; SI. The defaults are those of the program.
struct SimulateOptions {
  int rows = 21;       ///< particles along the warp
  int cols = 21;       ///< particles along the weft
  bool round = false;  ///< cut the specimen to the ellipse in the patch (Cusick's disc)
  int segments = 5;    ///< line segments per Kawabata curve; 1: G, B, first slope
  ClothModel model = ClothModel::consistent;  ///< `paper` ignores `mass`
  std::optional<CurveReach> reach = {};  ///< where the curves are fitted; absent: wherever measured
  bool internal_friction = false;        ///< both branches of bending and shear; "consistent" only
  Solver solver = Solver::rk4;
  MassRule mass = MassRule::area;
  double damping_per_s = 4;           ///< beta / m of the paper's F = -beta v
  double air_drag_kg_per_m3 = 0.6;    ///< F = -c area |v| v; half of air's density, factor 1
  double spring_damping_ratio = 0.1;  ///< damping ratio of the fastest stretch vibration
  double natural_time_s = 0.4;        ///< undisturbed motion before kinetic damping sets in
  bool kinetic_damping = true;        ///< zero all velocities at each peak of kinetic energy
  double residual_tolerance = 1e-3;   ///< in weights of a particle, see SimulateReport
  double static_tolerance = 1e-6;     ///< the same for the static solver
  /// Between particles; deeper than the greater of the two is not "at rest".
  double penetration_tolerance_m = 0.5e-3;
  double penetration_fraction = 0.1;  ///< share of the grid spacing
  double imperfection_m = 1e-6;       ///< height of the waves on a flat start
  double step_fraction = 0.9;         ///< share of the stability limit of the step
  int steps_between_looks = 32;       ///< at that limit; a sheet that diverges is run again with 1
  long max_steps = 400000;
  double history_interval_s = 0.02;  ///< between rows of history.csv
  bool contact_between_particles = true;
  int threads = 1;  ///< threads of the static solver's factorisation; never changes a result
  /// Layers of cloth keep this apart (m); 0: the sheet passes through itself.
  double cloth_thickness_m = 0.5e-3;
  /// Called now and then with the fraction of the step limit used and the residual so far.
  std::function<void(double fraction, double residual)> progress = {};

  /// Throws Error(usage) for a value that cannot be simulated.
  void check() const;
  /// True if it asks for what motion alone can do (solver "rk4").
  [[nodiscard]] bool only_moves() const {
    return model == ClothModel::paper || round || !kinetic_damping;
  }
};

/// The model's name with what else of it is not the default, as sheets state it.
[[nodiscard]] std::string model_text(const SimulateOptions& options);

/// Drapes the fabric over the scene's objects (paper section 4). `measured` places the start and
/// the pins. Throws Error for wrong input; a cloth that does not come to rest is a status.
[[nodiscard]] SimulateResult simulate(const Scene& scene, const Fabric& fabric, const Print& print,
                                      const std::optional<Sheet>& measured,
                                      const SimulateOptions& options);

/// Reach of a drape's strains: four times as far as a first run of the scene's own start at
/// 15 particles per side, with the curves fitted wherever they are measured. All grids, solvers and
/// numbers of segments of a scene are thereby fitted over the same range. Absent where that run
/// diverges.
[[nodiscard]] std::optional<CurveReach> find_reach(const Scene& scene, const Fabric& fabric,
                                                   const Print& print,
                                                   const std::optional<Sheet>& measured);

/// Laws for the particle grid from the measured curves, fitted up to `reach` or, without one,
/// wherever they are measured (a single line where the paper's section 5 takes it).
[[nodiscard]] ClothLaws make_laws(const Fabric& fabric, int segments, SimulateReport& report,
                                  const std::optional<CurveReach>& reach = std::nullopt);

/// Splits the loops of bending and shear into an elastic curve and friction elements
/// (laws.friction) and reports their fits. Tension stays on its loading branch: under a drape's own
/// weight its loop holds no energy worth counting. Twist, of which KES measures no loop, stays
/// elastic.
void add_internal_friction(const Fabric& fabric, int segments, ClothLaws& laws,
                           SimulateReport& report,
                           const std::optional<CurveReach>& reach = std::nullopt);

/// Column names of history.csv; inline, so that a reader of the file links no solver.
[[nodiscard]] inline std::vector<std::string> history_columns() {
  return {"time_s",
          "kinetic_energy_uJ",
          "gravity_energy_uJ",
          "stretch_energy_uJ",
          "shear_energy_uJ",
          "bending_energy_uJ",
          "twist_energy_uJ",
          "contact_energy_uJ",
          "largest_residual_per_particle_weight",
          "particles_touching"};
}

/// Columns with units: time, energies, residual, contacts.
[[nodiscard]] std::string history_csv(const std::vector<HistoryRow>& history);

/// certificate.json (schema drapebench/certificate/1).
void write_certificate(const std::filesystem::path& file, const SimulateResult& result,
                       const SimulateOptions& options);

}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::ClothModel>[] = {"consistent",
                                                                                    "paper"};
template <>
inline constexpr std::string_view drape::names_of<drape::simulate::Solver>[] = {"rk4", "static",
                                                                                "fall"};
