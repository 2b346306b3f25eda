// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/equilibrium/solver.hpp"
#include "simulate/simulate.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {

/// Inputs of a static run on a scene; the references must outlive it.
struct StaticCase {
  const Scene& scene;
  const Print& print;
  const std::optional<Sheet>& measured;
  const Surroundings& surroundings;
  const ClothLaws& laws;
  MassRule mass = MassRule::area;
};

/// Grids from coarse to fine, ending with `grid`: each has about twice the spacing of the next,
/// before one of more than 70 particles per side 1.4 times.
[[nodiscard]] std::vector<GridSpec> static_levels(const GridSpec& grid);

/// The thickness that layers of a sheet on that grid can keep apart, with a warning where it is
/// less.
[[nodiscard]] double thickness_on(const GridSpec& grid, double thickness_m,
                                  std::vector<std::string>& warnings);

/// Changes the start positions of the coarsest grid.
using StartChange = std::function<void(const GridSpec& grid, Field& position)>;

/// Sees the solver of the finest grid where it came to rest.
using AfterRest = std::function<void(StaticSolver& solver, const StaticReport& report)>;

struct StaticDrape {
  StartState start;  ///< start of the coarsest grid
  Field position;
  StaticReport report;      ///< report of the finest grid
  int iterations = 0;       ///< sum over all grids
  ClothMemory memory = {};  ///< state of internal friction, as the sheet ends
  double dissipated_j = 0;
};

/// True if a sheet that was taken to pass through itself, and did, has to meet itself.
[[nodiscard]] bool has_to_meet_itself(const GridSpec& grid, const StaticOptions& options,
                                      const Field& position, const StaticReport& found);

/// Drapes from the scene's start. A sheet that passes through itself as it falls, or ends so, is
/// draped once more, from the same start, as one that meets itself. Up to 41 particles per side on
/// the grid itself, because a coarse grid folds otherwise; beyond, to rest on a coarse grid first
/// and from its interpolation over finer ones, each only as near to rest as the next needs. A start
/// from the measured sheet stays on the finest grid, and so does a cloth with internal friction,
/// whose state is the grid's own; that one first goes through the scene's history.
[[nodiscard]] StaticDrape drape_statically(const StaticCase& the_case, const GridSpec& grid,
                                           const StaticOptions& options,
                                           const StartChange& change = {},
                                           const AfterRest& after = {});

[[nodiscard]] StaticOptions static_options(const Scene& scene, const SimulateOptions& options);

[[nodiscard]] HistoryRow history_row(const StaticIteration& iteration);

/// Fills the report, history and strains of `result` with what a drape found.
void book_static(const StaticCase& the_case, const GridSpec& grid, const StaticOptions& how,
                 const StaticDrape& drape, SimulateResult& result);

}  // namespace drape::simulate

namespace drape::simulate {

/// Result of simulate() from a drape that the static solver found: report with gaps and overlaps
/// judged, history, sheet and its source. `options` as given to simulate(), solver "static".
void finish_static(const StaticCase& the_case, const Fabric& fabric, const GridSpec& grid,
                   const SimulateOptions& options, const StaticDrape& drape,
                   SimulateResult& result);

}  // namespace drape::simulate
