// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/rig.hpp"
#include "core/sheet.hpp"
#include "core/simulation_files.hpp"
#include "simulate/fabric/laws.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {

/// Options of the paper's model, in SI units. The defaults are those of the program.
struct PaperOptions {
  int rows = 21;                      ///< particles along the warp
  int cols = 21;                      ///< particles along the weft
  double damping_per_s = 4;           ///< beta / m of the paper's F = -beta v
  double air_drag_kg_per_m3 = 0.6;    ///< F = -c area |v| v; half of the air's density, factor 1
  double spring_damping_ratio = 0.1;  ///< damping ratio of the fastest stretch mode
  double natural_time_s = 0.4;        ///< motion before kinetic damping starts
  bool kinetic_damping = true;        ///< set all velocities to zero at each peak of kinetic energy
  double residual_tolerance = 1e-3;   ///< largest net force at rest, in particle weights
  double imperfection_m = 1e-6;       ///< amplitude of the waves on the flat start
  double thickness_m = 0.5e-3;  ///< distance that layers of cloth keep; 0 if they do not interact
  double step_fraction = 0.9;   ///< fraction of the stable time step
  long max_steps = 400000;
  double history_interval_s = 0.02;  ///< interval between rows of history.csv
};
/// Describes all options except rows and columns, whose names differ between programs.
void fields(Fields& f, PaperOptions& options);

/// One row of history.csv.
struct HistoryRow {
  double time_s = 0, kinetic_j = 0, gravity_j = 0, stretch_j = 0, shear_j = 0, bending_j = 0,
         layers_j = 0, residual = 0;
  int contacts = 0;
};
/// Content of history.csv: time, energies, residual, contacts, with units.
[[nodiscard]] std::string history_csv(const std::vector<HistoryRow>& history);

struct PaperDrape {
  Sheet sheet;  ///< particles in the local frame, without source
  std::vector<HistoryRow> history;
};

/// Drapes the particle grid of paper section 4 over the scene's objects from a flat start; a pin
/// holds a weighted sum of particles around it. Fills in the certificate's verdict, strains,
/// distances, energies, grid and warnings. The sheet is at rest if the largest static force on a
/// particle is below the tolerance, the kinetic energy is below that of a fall by 10 um, the cloth
/// does not pass through itself, and no particle is in an object. A sheet that does not come to
/// rest is a status, not an error. Throws Error(bad_input) for clamps or a start in the measured
/// shape, and like start.hpp. `progress` receives the fraction of the step limit.
[[nodiscard]] PaperDrape run_paper_model(const LocalScene& local, const Print& print,
                                         const ClothLaws& laws, const PaperOptions& options,
                                         Certificate& certificate,
                                         const std::function<void(double)>& progress = {});

}  // namespace drape::simulate
