// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/simulate_report.hpp"

namespace drape::simulate {

/// How to simulate; SI. The defaults are those of the program.
struct SimulateOptions {
  int rows = 21;       ///< particles along the warp
  int cols = 21;       ///< particles along the weft
  bool round = false;  ///< cut the specimen to the ellipse in the patch (Cusick's disc)
  int segments = 5;    ///< line segments per Kawabata curve; 1: G, B, first slope
  std::string model = "consistent";      ///< or "paper", which ignores `mass`
  std::optional<CurveReach> reach = {};  ///< where the curves are fitted; absent: wherever measured
  bool internal_friction = false;        ///< both branches of bending and shear; "consistent" only
  std::string solver = "rk4";            ///< "rk4": motion with damping; "static": Newton's method
  MassRule mass = MassRule::area;
  double damping_per_s = 4;           ///< beta / m of the paper's F = -beta v
  double air_drag_kg_per_m3 = 0.6;    ///< F = -c area |v| v; half of air's density, factor 1
  double spring_damping_ratio = 0.1;  ///< of the fastest stretch vibration
  double natural_time_s = 0.4;        ///< undisturbed motion before kinetic damping sets in
  bool kinetic_damping = true;        ///< zero all velocities at each peak of kinetic energy
  double residual_tolerance = 1e-3;   ///< of a particle's weight, see SimulateReport
  double static_tolerance = 1e-6;     ///< the same for the static solver
  /// Between particles; deeper than the greater of the two is not "at rest".
  double penetration_tolerance_m = 0.5e-3;
  double penetration_fraction = 0.1;  ///< of the grid spacing
  double imperfection_m = 1e-6;       ///< height of the waves on a flat start
  double step_fraction = 0.9;         ///< of the stability limit of the step
  int steps_between_looks = 32;       ///< at that limit; a sheet that diverges is run again with 1
  long max_steps = 400000;
  double history_interval_s = 0.02;  ///< between rows of history.csv
  bool contact_between_particles = true;
  int threads = 1;  ///< of the static solver's factorisation; never changes a result
  /// Layers of cloth keep this apart (m); 0: the sheet passes through itself.
  double cloth_thickness_m = 0.5e-3;
  /// Called now and then with the fraction of the step limit used and the residual so far.
  std::function<void(double fraction, double residual)> progress = {};

  /// Throws Error(usage) for a value that cannot be simulated.
  void check() const;
  /// Whether it asks for what motion alone can do (solver "rk4").
  [[nodiscard]] bool only_moves() const { return model == "paper" || round || !kinetic_damping; }
};

/// The model's name with what else of it is not the default, as sheets state it.
[[nodiscard]] std::string model_text(const SimulateOptions& options);

/// Drapes the fabric over the scene's objects (paper section 4). `measured` places the start and
/// the pins. Throws Error for wrong input; a cloth that does not come to rest is a status.
[[nodiscard]] SimulateResult simulate(const Scene& scene, const Fabric& fabric, const Print& print,
                                      const std::optional<Sheet>& measured,
                                      const SimulateOptions& options);

/// How far a drape strains its cloth: four times as far as a first run of the scene's own start at
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
