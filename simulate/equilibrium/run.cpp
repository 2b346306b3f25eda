// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/units.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/equilibrium/prolong.hpp"
#include "simulate/start/clamps.hpp"
#include "simulate/start/history.hpp"
#include "simulate/start/start_check.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr int kDirect = 41;    // particles per side; without a coarser grid before
constexpr int kCoarsest = 21;  // particles per side
// Particles per side above which a grid's start has 0.7 times as many, not half: there a step costs
// much, and Richardson's start is the better the nearer two grids are.
constexpr int kGentle = 70;
// Residual in a particle's weight; enough to start a finer grid. The first finds the fold, the
// others are far from the finer one's rest whatever their own: those between only have to take out
// what carrying over brought in.
constexpr double kFirstResidual = 1e-2;
constexpr double kBetweenResidual = 1000;
constexpr double kLastCoarseResidual = 10;
// Residual of all but the first; a worse start costs a large grid more than that.
constexpr double kBeforeLarge = 1;
constexpr int kLarge = 121;            // particles per side
constexpr double kFinerStep_s = 0.03;  // first pseudo-time step on a finer grid
// Relative to the spacing: thicker layers would meet themselves
constexpr double kThicknessFraction = 0.5;
constexpr int kAsymptotic = 51;  // particles per side from which the model's order shows

int larger_side(const GridSpec& grid) {
  return std::max(grid.rows, grid.cols);
}

/// Distance from its rest to which a coarser grid has to come.
double start_residual(std::size_t level, const std::vector<GridSpec>& levels) {
  if (level == 0) return kFirstResidual;
  if (larger_side(levels.back()) >= kLarge) return kBeforeLarge;
  return level + 2 == levels.size() ? kLastCoarseResidual : kBetweenResidual;
}

/// Where a finer grid starts: where the coarser one ended, moved on by what the finer spacing will
/// do more, as the ends of two grids tell (Richardson 1911; the model is of order 2).
Field finer_start(const Field& rest, const GridSpec& grid, const Field& before,
                  const GridSpec& coarser, const GridSpec& finer) {
  if (std::min(coarser.rows, coarser.cols) < kAsymptotic) return prolong(rest, grid, finer);
  const auto square = [](const GridSpec& g) { return g.warp_spacing_m() * g.warp_spacing_m(); };
  const double fraction = (square(grid) - square(finer)) / (square(coarser) - square(grid));
  const Field from = prolong(before, coarser, grid);
  Field ahead = rest;
  for (std::size_t k = 0; k < ahead.size(); ++k) ahead[k] += fraction * (rest[k] - from[k]);
  return prolong(ahead, grid, finer);
}

std::string sentence_of(const StaticReport& found, int iterations) {
  switch (found.status) {
    case StaticStatus::at_rest:
      return "at rest";
    case StaticStatus::diverged:
      return fmt::format("diverged after {} iterations", iterations);
    case StaticStatus::stalled:
      return fmt::format("stalled after {} iterations: residual {:.2g} of a particle's weight",
                         iterations, found.residual);
    case StaticStatus::iteration_limit:
      break;
  }
  return fmt::format("not at rest after {} iterations: residual {:.2g} of a particle's weight",
                     iterations, found.residual);
}

}  // namespace

double thickness_on(const GridSpec& grid, double thickness_m, std::vector<std::string>& warnings) {
  const double most = kThicknessFraction * std::min(grid.warp_spacing_m(), grid.weft_spacing_m());
  if (thickness_m <= most) return thickness_m;
  warnings.push_back(
      fmt::format("the particles are too near each other for the cloth's thickness: layers keep "
                  "{:.3g} mm apart",
                  most / units::mm));
  return most;
}

std::vector<GridSpec> static_levels(const GridSpec& grid) {
  std::vector<GridSpec> levels{grid};
  for (;;) {
    const GridSpec& last = levels.back();
    const bool gently = larger_side(last) > kGentle;
    const auto fewer = [&](int points) {
      const int pieces = points - 1;
      return 1 + (gently ? static_cast<int>(std::lround(pieces / std::numbers::sqrt2))
                         : (pieces + 1) / 2);
    };
    const GridSpec next{fewer(last.rows), fewer(last.cols), grid.patch_m};
    if (std::min(next.rows, next.cols) < kCoarsest) break;
    levels.push_back(next);
  }
  std::reverse(levels.begin(), levels.end());
  return levels;
}

namespace {

/// State that a cloth brings along.
struct Past {
  std::optional<ClothMemory> memory;
  PastEvent shakes;  ///< once it rests
};

/// Follows gravity up and down from a rest, and back to where it was.
StaticReport shake(StaticSolver& solver, const PastEvent& shakes, const Vector3d& gravity,
                   StaticReport report) {
  std::vector<double> loads;
  for (int k = 0; k < shakes.times; ++k)
    loads.insert(loads.end(), {1 + shakes.part, 1 - shakes.part});
  if (shakes.times > 0) loads.push_back(1);
  for (const double load : loads) {
    if (report.status != StaticStatus::at_rest) break;
    solver.load(load * gravity);
    StaticReport next = solver.solve();
    next.iterations += report.iterations;
    next.history.insert(next.history.begin(), report.history.begin(), report.history.end());
    report = std::move(next);
  }
  return report;
}

/// Drapes once. A sheet that meets itself stays on its grid: another one's rest may pass through
/// itself there.
StaticDrape drape_once(const StaticCase& the_case, const GridSpec& grid,
                       const StaticOptions& options, const StartChange& change,
                       const AfterRest& after, const Past& past) {
  const Scene& scene = the_case.scene;
  std::vector<GridSpec> levels = static_levels(grid);
  if (larger_side(grid) <= kDirect || scene.start.mode == StartMode::measured ||
      the_case.laws.friction || options.meets_itself)
    levels = {grid};
  StaticDrape drape;
  GridSpec coarse, coarser;  // the two grids before, nothing at first
  Field before;
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const GridSpec& here = levels[level];
    const bool first = level == 0;
    const bool last = level + 1 == levels.size();
    Cloth cloth(here, the_case.laws, the_case.mass);
    cloth.clamp(clamps_on(scene, here).places);
    StaticOptions now = options;
    if (!last) {
      now.only_a_start = true;
      now.residual_tolerance = std::max(start_residual(level, levels), options.residual_tolerance);
    }
    now.judge_stability = last;
    if (!first && now.falls == Falls::first) now.falls = last ? Falls::where_stalled : Falls::never;
    if (!first) {
      now.first_step_s = kFinerStep_s;
      now.paced = false;
    }
    const StartState state = make_start(scene, the_case.print, here, the_case.measured,
                                        the_case.surroundings.top_z_m(), 1e-6);
    StaticSolver solver(cloth, the_case.surroundings, now);
    solver.contacts().hold(state.holds, state.hold_in_world);
    solver.position =
        first ? state.position : finer_start(drape.position, coarse, before, coarser, here);
    if (first) {
      drape.start = state;
      for (std::string& fault : faults_of_start(here, state.position, the_case.surroundings)) {
        drape.start.report.warnings.push_back(std::move(fault));
      }
      if (change) change(here, solver.position);
    }
    const int lifted = lift_out(the_case.surroundings, solver.position);
    if (first && lifted > 0) drape.start.report.warnings.push_back(warning_of_lifted(lifted));
    if (past.memory) cloth.remember(*past.memory);
    drape.report = shake(solver, past.shakes, now.gravity_m_per_s2, solver.solve());
    before.swap(drape.position);
    drape.position = solver.position;
    drape.iterations += drape.report.iterations;
    drape.memory = cloth.memory();
    drape.dissipated_j = cloth.dissipated_j();
    if (last && after && drape.report.status == StaticStatus::at_rest &&
        !has_to_meet_itself(grid, options, drape.position, drape.report))
      after(solver, drape.report);
    coarser = coarse;
    coarse = here;
    if (drape.report.status == StaticStatus::diverged || drape.report.through_itself) break;
  }
  if (coarse.count() != grid.count()) drape.position = prolong(drape.position, coarse, grid);
  return drape;
}

/// Drapes a cloth that remembers after what it went through; else once.
StaticDrape drape_after_history(const StaticCase& the_case, const GridSpec& grid,
                                const StaticOptions& options, const StartChange& change,
                                const AfterRest& after) {
  const std::vector<PastEvent> history = history_of(the_case.scene);
  if (history.empty() || !the_case.laws.friction)
    return drape_once(the_case, grid, options, change, after, {});
  StaticDrape drape;
  int number = 0;
  const auto before = [&](const ClothMemory& memory) -> std::optional<ClothMemory> {
    drape = drape_once(the_case, grid, options, change, {}, {memory, {}});
    ++number;
    if (drape.report.status == StaticStatus::at_rest) return drape.memory;
    drape.start.report.warnings.push_back(not_at_rest_before(number));
    return std::nullopt;
  };
  const std::optional<ClothMemory> memory = memory_after(
      history, *the_case.laws.friction, Cloth(grid, the_case.laws, the_case.mass).memory(), before);
  if (!memory) return drape;
  return drape_once(the_case, grid, options, change, after, {memory, shakes_of(history)});
}

}  // namespace

bool has_to_meet_itself(const GridSpec& grid, const StaticOptions& options, const Field& position,
                        const StaticReport& found) {
  return !options.meets_itself && options.cloth_thickness_m > 0 &&
         found.status != StaticStatus::diverged &&
         (found.through_itself || passes_through_itself(grid, position));
}

StaticDrape drape_statically(const StaticCase& the_case, const GridSpec& grid,
                             const StaticOptions& options, const StartChange& change,
                             const AfterRest& after) {
  refuse_flat_start_inside(the_case.scene, grid, the_case.surroundings);
  StaticDrape drape = drape_after_history(the_case, grid, options, change, after);
  if (!has_to_meet_itself(grid, options, drape.position, drape.report)) return drape;
  StaticOptions meets = options;
  meets.meets_itself = true;
  std::vector<std::string> warnings;
  meets.cloth_thickness_m = thickness_on(grid, options.cloth_thickness_m, warnings);
  drape = drape_after_history(the_case, grid, meets, change, after);
  std::vector<std::string>& all = drape.start.report.warnings;
  all.insert(all.end(), warnings.begin(), warnings.end());
  return drape;
}

StaticOptions static_options(const Scene& scene, const SimulateOptions& options) {
  StaticOptions how;
  how.gravity_m_per_s2 = scene.gravity_m_per_s2;
  how.friction = scene.friction;
  how.contact_between_particles = options.contact_between_particles;
  how.cloth_thickness_m = options.cloth_thickness_m;
  how.residual_tolerance = options.static_tolerance;
  how.threads = options.threads;
  how.falls = options.solver == Solver::fall ? Falls::first : Falls::never;
  how.damping_per_s = options.damping_per_s;
  how.natural_time_s = options.natural_time_s;
  how.max_iterations = static_cast<int>(std::min<long>(options.max_steps, how.max_iterations));
  return how;
}

HistoryRow history_row(const StaticIteration& row) {
  return {row.pseudo_time_s, 0,
          row.gravity_j,     row.inner.stretch_j,
          row.inner.shear_j, row.inner.bending_j,
          row.inner.twist_j, row.contact_j,
          row.residual,      row.touching};
}

void book_static(const StaticCase& the_case, const GridSpec& grid, const StaticOptions& how,
                 const StaticDrape& drape, SimulateResult& result) {
  SimulateReport& report = result.report;
  const StaticReport& found = drape.report;
  const std::vector<std::string>& warnings = drape.start.report.warnings;
  report.warnings.insert(report.warnings.end(), warnings.begin(), warnings.end());
  for (const StaticIteration& row : found.history) {
    result.history.push_back(history_row(row));
  }
  report.status = found.status == StaticStatus::at_rest    ? RestStatus::at_rest
                  : found.status == StaticStatus::diverged ? RestStatus::diverged
                                                           : RestStatus::step_limit;
  report.sentence = sentence_of(found, drape.iterations);
  report.steps = drape.iterations;
  report.residual = found.residual;
  report.residual_rms = found.residual_rms;
  report.residual_tolerance = how.residual_tolerance;
  report.contacts = found.touching;
  report.contacts_between = found.between;
  report.contacts_pairs = found.layers;
  report.cloth_thickness_m = found.cloth_thickness_m;
  report.hold_error_m = found.pin_error_m;
  report.time_s = found.history.empty() ? 0 : found.history.back().pseudo_time_s;
  if (!found.history.empty()) {
    report.energy_start_j = found.history.front().sum_j();
    report.energy_end_j = found.history.back().sum_j();
  }
  if (the_case.laws.friction) {
    report.lost_internal_friction_j = drape.dissipated_j;
    result.memory = drape.memory;
  }
  if (found.status == StaticStatus::at_rest && !found.stable) {
    report.warnings.emplace_back(
        "the equilibrium is a saddle: the stiffness of the sheet on its contacts is not positive "
        "definite");
  }
  if (found.fell_on > 0)
    report.warnings.push_back(fmt::format("stalled and fell on from there, {} time{}",
                                          found.fell_on, found.fell_on == 1 ? "" : "s"));
  result.contact_forces = found.contact_forces;
  Cloth cloth(grid, the_case.laws, the_case.mass);
  cloth.clamp(clamps_on(the_case.scene, grid).places);
  report.strains = cloth.strains(drape.position);
}

}  // namespace drape::simulate
