// SPDX-License-Identifier: Apache-2.0
#include "simulate/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/cloth/drape_coefficient.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/equilibrium/run.hpp"
#include "simulate/motion_run.hpp"
#include "simulate/start/clamps.hpp"
#include "simulate/start/history.hpp"
#include "simulate/start/start.hpp"
#include "simulate/start/start_check.hpp"
#include "simulate/world.hpp"

namespace drape::simulate {

namespace {

using Eigen::Vector3d;
using units::mm;

constexpr double kMostResidual = 1e-3;      // relative to a particle's weight, on a sheet at rest
constexpr double kPolishStep_s = 10;        // first pseudo-time step from a rest of motion
constexpr double kPolishReach_m = 2e-7;     // particles nearer to a surface press on it
constexpr double kPolishMove_m = 0.5 * mm;  // displacement of a particle; farther is another valley

/// Damping time of the springs for a ratio at the highest stretch frequency omega:
/// force = tau * stiffness * rate damps it by tau omega / 2.
double spring_damping_s(const ClothLaws& laws, const GridSpec& grid, double ratio) {
  const double warp = std::sqrt(laws.tensile[0].slope) / grid.warp_spacing_m();
  const double weft = std::sqrt(laws.tensile[1].slope) / grid.weft_spacing_m();
  const double omega = 2 * std::max(warp, weft) / std::sqrt(laws.density_kg_per_m2);
  return 2 * ratio / omega;
}

Sheet sheet_of(const GridSpec& grid, const Field& position) {
  Sheet sheet;
  sheet.rows = grid.rows;
  sheet.cols = grid.cols;
  sheet.patch_m = grid.patch_m;
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      SheetMark mark;
      mark.mark = {r, c};
      mark.material_m = material_of(grid, r, c);
      mark.point_in_world = at(position, grid.index(r, c));
      if (grid.cells_at(r, c) == 0) {
        sheet.gaps.push_back({mark.mark, "outside the round specimen"});
      } else if (mark.point_in_world.allFinite()) {
        sheet.marks.push_back(mark);
      } else {
        sheet.gaps.push_back({mark.mark, "the simulation diverged"});
      }
    }
  }
  return sheet;
}

SimulatedSource source_of(const Scene& scene, const Fabric& fabric, const SimulateOptions& options,
                          const SimulateReport& report) {
  return {.scene = scene.name,
          .fabric = fabric.name,
          .scene_sha256 = scene.document.sha256(),
          .fabric_sha256 = fabric_sha256(fabric),
          .start_sha256 = std::nullopt,
          .segments = options.segments,
          .model = model_text(options),
          .solver = std::string(drape::name_of(options.solver)),
          .status = report.sentence};
}

}  // namespace

std::string model_text(const SimulateOptions& options) {
  std::string text(drape::name_of(options.model));
  if (options.internal_friction) text += ", internal friction";
  if (options.model == ClothModel::consistent && !options.reach) text += ", whole curves";
  return text;
}

void SimulateOptions::check() const {
  const auto require = [](bool good, const char* what, const char* to_do) {
    if (!good) throw usage_error(what, to_do);
  };
  require(!internal_friction || model == ClothModel::consistent,
          "the model `paper` has no internal friction", "use --model consistent");
  if (model == ClothModel::paper && solver != Solver::rk4) {
    throw usage_error("the model `paper` has no energy for the static solver to minimise",
                      "use --solver rk4, or --model consistent");
  }
  require(!round || (model == ClothModel::consistent && solver == Solver::rk4),
          "a round specimen is draped by the model `consistent` and the solver `rk4` only",
          "leave out --round, --model and --solver");
  require(rows >= 3 && cols >= 3 && rows <= 401 && cols <= 401,
          "the grid is smaller than 3 or larger than 401 particles per side", "give --grid 21");
  require(segments >= 1 && segments <= 20, "a curve has 1 to 20 segments", "give --segments 5");
  require(damping_per_s >= 0 && air_drag_kg_per_m3 >= 0 && spring_damping_ratio >= 0,
          "a damping is negative", "give 0 or more");
  require(spring_damping_ratio <= 0.5, "the spring damping ratio is above 0.5",
          "larger ratios need shorter steps; give at most 0.5");
  require(residual_tolerance > 0 && static_tolerance > 0, "the residual tolerance is not positive",
          "give e.g. 0.001");
  require(
      residual_tolerance <= kMostResidual && static_tolerance <= kMostResidual,
      "the residual tolerance is above 0.001 of a particle's weight: such a sheet does not rest",
      "give 0.001 or less");
  require(cloth_thickness_m >= 0 && cloth_thickness_m <= 0.01,
          "the cloth's thickness is not in 0 .. 10 mm", "give 0.5, or 0 to let it pass itself");
  require(penetration_tolerance_m > 0, "the penetration tolerance is not positive",
          "give e.g. 0.5");
  require(max_steps > 0, "the step limit is not positive", "give e.g. 400000");
  require(step_fraction > 0 && step_fraction <= 0.95,
          "the step is not in 0 .. 0.95 of its stability limit",
          "0.9 leaves a margin to the stability limit");
  require(natural_time_s >= 0 && imperfection_m >= 0 && history_interval_s > 0,
          "a time or the imperfection is negative", "give 0 or more");
}

void finish_static(const StaticCase& the_case, const Fabric& fabric, const GridSpec& grid,
                   const SimulateOptions& options, const StaticDrape& drape,
                   SimulateResult& result) {
  const StaticOptions how = static_options(the_case.scene, options);
  book_static(the_case, grid, how, drape, result);
  measure_gaps(grid, the_case.surroundings, drape.position, result.report);
  judge_overlaps(grid, the_case.surroundings, drape.position, options, result.report);
  result.sheet = sheet_of(grid, drape.position);
  result.sheet.source = source_of(the_case.scene, fabric, options, result.report);
}

namespace {

/// Takes the end of motion to the static tolerance on the places of contact that it has. A sheet
/// that would go elsewhere, or touches itself or sharp edges, stays as motion left it: then the
/// tolerance is motion's, and a warning says why.
Field polish(const StaticCase& the_case, const SimulateOptions& options, const StartState& start,
             const MotionRun& run, Cloth& cloth, SimulateResult& result) {
  SimulateReport& report = result.report;
  const Field& end = run.position();
  const ClothMemory memory = cloth.memory();
  const auto keep = [&](const std::string& why) {
    cloth.remember(memory);
    report.warnings.push_back(
        fmt::format("at rest to {:.2g} of a particle's weight only: {}", report.residual, why));
    return end;
  };
  if (report.contacts_pairs > 0)
    return keep("the sheet touches itself or an edge, which the static solver does not know");
  if (options.round) return keep("a round specimen is left as motion finds it");
  StaticOptions how = static_options(the_case.scene, options);
  how.falls = Falls::never;
  how.first_step_s = kPolishStep_s;
  StaticSolver solver(cloth, the_case.surroundings, how);
  solver.contacts().hold(start.holds, start.hold_in_world);
  solver.position = end;
  solver.contacts().take_springs(run.motion().line_contacts(), end);
  solver.rest_on_contacts(kPolishReach_m);
  const StaticReport found = solver.solve();
  double farthest = 0;
  for (int i = 0; i < cloth.count(); ++i)
    farthest = std::max(farthest, (at(solver.position, i) - at(end, i)).norm());
  if (found.status != StaticStatus::at_rest)
    return keep(fmt::format("the polish ends at {:.2g} of a weight", found.residual));
  if (farthest > kPolishMove_m)
    return keep(fmt::format("the polish leaves the valley, by up to {:.1f} mm", farthest / mm));
  report.residual = found.residual;
  report.residual_rms = found.residual_rms;
  report.residual_tolerance = how.residual_tolerance;
  report.strains = cloth.strains(solver.position);
  report.energy_end_j = found.history.back().sum_j();
  result.history.push_back(history_row(found.history.back()));
  result.history.back().time_s = report.time_s;
  result.contact_forces = found.contact_forces;
  measure_gaps(cloth.grid(), the_case.surroundings, solver.position, report);
  return solver.position;
}

/// Lets gravity grow and shrink under a sheet that motion has brought to rest.
void shake(MotionRun& run, const PastEvent& shakes, const Vector3d& gravity,
           SimulateResult& result) {
  const auto go = [&](double load) {
    if (result.report.status != RestStatus::at_rest) return;
    run.load(load * gravity, result.report);
    run.go(result);
  };
  for (int k = 0; k < shakes.times; ++k) {
    go(1 + shakes.part);
    go(1 - shakes.part);
  }
  if (shakes.times > 0) go(1);
}

/// By Runge-Kutta; with the solver "fall" then polished. `memory`: what a cloth with internal
/// friction brings along.
SimulateResult move_with(const StaticCase& the_case, const Fabric& fabric, const GridSpec& grid,
                         const SimulateOptions& options, SimulateResult result,
                         const std::optional<ClothMemory>& memory, const PastEvent& shakes) {
  SimulateReport& report = result.report;
  const Scene& scene = the_case.scene;
  const Surroundings& surroundings = the_case.surroundings;
  Cloth cloth(grid, the_case.laws, options.mass, options.model);
  cloth.clamp(clamps_on(scene, grid).places);
  refuse_flat_start_inside(scene, grid, surroundings);
  const StartState start = make_start(scene, the_case.print, grid, the_case.measured,
                                      surroundings.top_z_m(), options.imperfection_m);
  SimulateOptions how = options;
  how.cloth_thickness_m = thickness_on(grid, options.cloth_thickness_m, report.warnings);
  report.cloth_thickness_m = how.cloth_thickness_m;
  if (memory) cloth.remember(*memory);
  MotionRun run(cloth, surroundings, scene, how);
  run.start(start, scene.start.mode == StartMode::measured, report);
  run.go(result);
  shake(run, shakes, scene.gravity_m_per_s2, result);
  report.clamped_springs = cloth.clamped_springs(run.position());
  if (report.clamped_springs > 0) {
    report.warnings.push_back(fmt::format(
        "K_st is below K_diag in {} grid line springs: K'_st is held at 0 there and the cloth is "
        "stiffer than its tensile curve",
        report.clamped_springs));
  }
  const bool polishes = options.solver == Solver::fall && report.status == RestStatus::at_rest;
  const Field end =
      polishes ? polish(the_case, options, start, run, cloth, result) : run.position();
  judge_overlaps(grid, surroundings, end, options, report);
  report.drape_coefficient = drape_coefficient(grid, end, scene);
  if (the_case.laws.friction) {
    report.lost_internal_friction_j = cloth.dissipated_j();
    result.memory = cloth.memory();
  }
  result.sheet = sheet_of(grid, end);
  result.sheet.source = source_of(scene, fabric, options, report);
  return result;
}

/// move_with(), once more where the sheet diverges: it can stretch past a bend of its curve, to
/// where its limit is three times shorter, between two looks at the limit.
SimulateResult move_once(const StaticCase& the_case, const Fabric& fabric, const GridSpec& grid,
                         SimulateOptions options, SimulateResult result,
                         const std::optional<ClothMemory>& memory, const PastEvent& shakes) {
  SimulateResult found = move_with(the_case, fabric, grid, options, result, memory, shakes);
  if (found.report.status != RestStatus::diverged) return found;
  options.steps_between_looks = 1;
  result.report.warnings.push_back(fmt::format(
      "{}: run again with a look at the limit before each step", found.report.sentence));
  return move_with(the_case, fabric, grid, options, result, memory, shakes);
}

/// move_once(), after what the cloth went through.
SimulateResult simulate_by_motion(const StaticCase& the_case, const Fabric& fabric,
                                  const GridSpec& grid, const SimulateOptions& options,
                                  const SimulateResult& result) {
  const std::vector<PastEvent> history = history_of(the_case.scene);
  if (history.empty() || !the_case.laws.friction)
    return move_once(the_case, fabric, grid, options, result, std::nullopt, {});
  SimulateOptions by_motion = options;
  by_motion.solver = Solver::rk4;
  SimulateResult drape;
  int number = 0;
  const auto before = [&](const ClothMemory& memory) -> std::optional<ClothMemory> {
    drape = move_once(the_case, fabric, grid, by_motion, result, memory, {});
    ++number;
    if (drape.report.status == RestStatus::at_rest) return drape.memory;
    drape.report.warnings.push_back(not_at_rest_before(number));
    return std::nullopt;
  };
  const std::optional<ClothMemory> memory = memory_after(
      history, *the_case.laws.friction, Cloth(grid, the_case.laws, options.mass).memory(), before);
  if (!memory) return drape;
  return move_once(the_case, fabric, grid, options, result, memory, shakes_of(history));
}

void require_clampable(const Scene& scene, const SimulateOptions& options) {
  if (scene.clamps.empty()) return;
  const auto require = [&](bool good, const char* what, const char* to_do) {
    if (!good) throw bad_input(what, {.file = scene.file.string(), .field = "clamp"}, to_do);
  };
  require(!options.internal_friction, "a clamped cloth has no internal friction at its clamp",
          "leave out --internal-friction, or hold it with [[pin]]");
  require(!options.round, "a round specimen has no edge for a clamp", "hold it with [[pin]]");
}

/// In the frame of `scene`. A sheet that falls by implicit steps knows neither itself nor sharp
/// edges: where it would end in one of them, or nowhere, it falls by Runge-Kutta instead.
SimulateResult simulate_here(const Scene& scene, const Fabric& fabric, const Print& print,
                             const std::optional<Sheet>& measured, const SimulateOptions& options) {
  SimulateResult result;
  SimulateReport& report = result.report;
  const GridSpec grid{options.rows, options.cols, print.patch_m, options.round};
  require_clampable(scene, options);
  ClothLaws laws = make_laws(fabric, options.segments, report, options.reach);
  if (options.internal_friction)
    add_internal_friction(fabric, options.segments, laws, report, options.reach);
  if (options.model == ClothModel::paper) {
    laws.twist_n_m = report.twist_n_m = 0;
    report.warnings = fabric.warnings;  // without those of the twist stiffness, which it has not
  }
  if (!options.internal_friction && !history_of(scene).empty())
    report.warnings.emplace_back(
        "start.history leaves no trace: without --internal-friction the cloth has no memory");
  check_pins(scene, print, fabric);
  for (std::string& warning : check_clamps(scene, grid))
    report.warnings.push_back(std::move(warning));
  laws.stretch_damping_s = spring_damping_s(laws, grid, options.spring_damping_ratio);
  const Surroundings surroundings(scene);
  const StaticCase the_case{scene, print, measured, surroundings, laws, options.mass};
  if (options.solver == Solver::rk4 || options.round)
    return simulate_by_motion(the_case, fabric, grid, options, result);
  SimulateResult fallen = result;
  finish_static(the_case, fabric, grid, options,
                drape_statically(the_case, grid, static_options(scene, options)), fallen);
  if (options.solver == Solver::newton || fallen.report.status == RestStatus::at_rest)
    return fallen;
  report.warnings.push_back("fell by Runge-Kutta: by implicit steps it ends " +
                            fallen.report.sentence);
  return simulate_by_motion(the_case, fabric, grid, options, result);
}

/// A curve that bends where its fit ends, and a drape that goes farther, are worth a warning.
void judge_reach(const SimulateOptions& options, SimulateReport& report) {
  if (!options.reach || options.segments == 1) return;
  const Cloth::Strains& found = report.strains;
  for (const CurveReport& curve : report.curves) {
    const double most = curve.name == "tensile warp"         ? found.warp_most
                        : curve.name == "tensile weft"       ? found.weft_most
                        : curve.name.starts_with("bending ") ? found.curvature_most_per_m
                                                             : found.shear_most_rad;
    if (curve.segments == 1 || most <= curve.range ||
        curve.name.find("friction") != std::string::npos)
      continue;
    report.warnings.push_back(fmt::format(
        "{}: the cloth is strained {:.1f} times as far as its curve was fitted; --fit whole fits "
        "all that was measured",
        curve.name, most / curve.range));
  }
}

}  // namespace

void take_to_world(const LocalScene& local, double sheet_kg, SimulateResult& result) {
  SimulateReport& report = result.report;
  for (SheetMark& mark : result.sheet.marks)
    mark.point_in_world = local.to_world(mark.point_in_world);
  const Eigen::AngleAxisd turn(local.yaw_rad, Vector3d::UnitZ());
  for (ContactForce& contact : result.contact_forces)
    contact.force_in_world = turn * contact.force_in_world;
  const double more_j = local.gravity_offset_j(sheet_kg);
  for (HistoryRow& row : result.history) row.gravity_j += more_j;
  report.energy_start_j += more_j;
  report.energy_end_j += more_j;
  report.placed_yaw_rad = local.placed.flat.yaw_rad;
  report.placed_centre_in_world = local.placed.flat.centre_in_world;
  report.placed_by_marks = local.placed.marks_used;
  report.placement_rms_mm = local.placed.placement_rms_mm;
}

double mass_kg(const Fabric& fabric, const Print& print, const SimulateOptions& options) {
  const GridSpec grid{options.rows, options.cols, print.patch_m, options.round};
  int cells = 0;
  for (int i = 0; i < grid.count(); ++i) cells += grid.has_cell(i / grid.cols, i % grid.cols);
  return fabric.areal_density_kg_per_m2 * cells * grid.warp_spacing_m() * grid.weft_spacing_m();
}

SimulateResult simulate(const Scene& scene, const Fabric& fabric, const Print& print,
                        const std::optional<Sheet>& measured, const SimulateOptions& options) {
  options.check();
  const LocalScene local = local_scene(scene, measured, Surroundings(scene).top_z_m());
  SimulateResult result = simulate_here(local.scene, fabric, print, local.measured, options);
  take_to_world(local, mass_kg(fabric, print, options), result);
  judge_reach(options, result.report);
  const GridSpec grid{options.rows, options.cols, print.patch_m, options.round};
  for (std::string& warning : warnings_of_scene(scene, result.report.least_gap_object_m, grid))
    result.report.warnings.push_back(std::move(warning));
  judge_clamps(scene, grid, result.sheet, result.report);
  return result;
}

namespace {

constexpr int kFirstGrid = 15;  // particles per side: a fold or two of any drape, in 0.1 s
// A crease holds its bend within a few particles, so that its strains grow with their number: to 61
// per side four times those of the first run.
constexpr double kFinerGrids = 4;
constexpr int kFirstSegments = 5;  // those of the paper

}  // namespace

std::optional<CurveReach> find_reach(const Scene& scene, const Fabric& fabric, const Print& print,
                                     const std::optional<Sheet>& measured) {
  const LocalScene local = local_scene(scene, measured, Surroundings(scene).top_z_m());
  SimulateReport ignored;
  const ClothLaws laws = make_laws(fabric, kFirstSegments, ignored);
  const Surroundings surroundings(local.scene);
  const StaticCase the_case{local.scene, print, local.measured, surroundings, laws};
  SimulateOptions how;
  how.solver = Solver::fall;
  const GridSpec grid{kFirstGrid, kFirstGrid, print.patch_m};
  const StaticDrape first = drape_statically(the_case, grid, static_options(local.scene, how));
  Cloth cloth(grid, laws, MassRule::area);
  cloth.clamp(clamps_on(local.scene, grid).places);
  const Cloth::Strains strains = cloth.strains(first.position);
  const CurveReach reach{.tensile = {kFinerGrids * std::max(strains.warp_most, 0.0),
                                     kFinerGrids * std::max(strains.weft_most, 0.0)},
                         .shear_rad = kFinerGrids * strains.shear_most_rad,
                         .curvature_per_m = kFinerGrids * strains.curvature_most_per_m};
  const double sum = reach.tensile[0] + reach.tensile[1] + reach.shear_rad + reach.curvature_per_m;
  return std::isfinite(sum) ? std::optional(reach) : std::nullopt;
}

}  // namespace drape::simulate
