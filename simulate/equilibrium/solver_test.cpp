// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/solver.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/units.hpp"
#include "simulate/dynamics/motion.hpp"
#include "simulate/ensemble/checked.hpp"
#include "simulate/equilibrium/prolong.hpp"
#include "simulate/equilibrium/run.hpp"
#include "simulate/simulate.hpp"
#include "simulate/test_drape.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

SimulateResult run(const Scene& scene, int grid, Solver solver, int segments = 1) {
  return drape_of(scene, options_of(grid, solver, segments));
}

double distance_m(const Field& a, const Field& b) {
  const std::size_t n = a.size() / 3;
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i) {
    largest = std::max(
        largest, Vector3d(a[i] - b[i], a[n + i] - b[n + i], a[2 * n + i] - b[2 * n + i]).norm());
  }
  return largest;
}

TEST(StaticSolver, DrapesOverTheSphereToRest) {
  for (const int grid : {11, 21}) {
    const SimulateResult result = run(lying_scene("A"), grid, Solver::newton);
    EXPECT_EQ(result.report.status, RestStatus::at_rest) << result.report.sentence;
    EXPECT_LE(result.report.residual, 1e-6);
    EXPECT_GT(*result.report.least_gap_object_m, -1e-8);
    EXPECT_LT(result.report.energy_end_j, result.report.energy_start_j);
    EXPECT_FALSE(result.history.empty());
    EXPECT_TRUE(std::none_of(result.report.warnings.begin(), result.report.warnings.end(),
                             [](const std::string& w) { return w.find("saddle") != w.npos; }));
  }
}

TEST(StaticSolver, TheSameAgainGivesTheSameBytes) {
  const Scene scene = lying_scene("A");
  const SimulateResult one = run(scene, 11, Solver::newton, 5);
  const SimulateResult two = run(scene, 11, Solver::newton, 5);
  for (std::size_t i = 0; i < one.sheet.marks.size(); ++i) {
    EXPECT_EQ(one.sheet.marks[i].point_in_world, two.sheet.marks[i].point_in_world);
  }
}

TEST(StaticSolver, PinnedSheetHangsAsByRungeKutta) {
  const SimulateResult result = run(hanging_scene(), 12, Solver::newton);
  EXPECT_EQ(result.report.status, RestStatus::at_rest) << result.report.sentence;
  EXPECT_LT(result.report.hold_error_m, 1e-8);
}

/// The paper's D: a corner, a particle, starts 22 mm from its place, and so does a point of its
/// cell.
TEST(StaticSolver, PinsOfOneCellTravelTogether) {
  Scene scene = read_scene(test::source_root() / "rigs/paper/scenes/D.toml");
  scene.pins.push_back(
      {{}, Vector3d(-74.5, 97, 200.5) * mm, Eigen::Vector2d::Constant(3 * mm).eval()});
  const SimulateResult result = run(scene, 21, Solver::fall, 5);
  EXPECT_EQ(result.report.status, RestStatus::at_rest) << result.report.sentence;
  EXPECT_LT(result.report.hold_error_m, 1e-8);
  EXPECT_TRUE(std::none_of(result.report.warnings.begin(), result.report.warnings.end(),
                           [](const std::string& w) { return w.find("Runge") != w.npos; }));
}

/// The cube C, slippery, and a sheet that pins keep on its top.
Scene slippery_cube(const Print& print) {
  Scene scene = lying_scene("C");
  scene.friction = 0;
  const auto& box = std::get<Box>(scene.obstacles.front());
  const double top = Surroundings(scene).top_z_m();
  scene.start.centre_in_world = {box.world_from_box.translation_m.x(),
                                 box.world_from_box.translation_m.y(), top};
  scene.start.yaw_rad = 0;
  for (const int k : {-1, 0, 1}) {
    Pin pin;
    pin.mark = {print.rows / 2 + 2 * k, print.cols / 2 + (k == 0 ? 2 : 0)};
    const Eigen::Vector2d at = pin.material_m(print);
    pin.point_in_world = *scene.start.centre_in_world + Vector3d(at.y() - print.patch_m.y() / 2,
                                                                 print.patch_m.x() / 2 - at.x(), 0);
    scene.pins.push_back(pin);
  }
  return scene;
}

/// Distance of the triangles of a cell, which press, from the bilinear cell that the depth is
/// measured in: at most a sixteenth of its twist x00 - x01 - x10 + x11.
double triangles_off_cells(const Sheet& sheet) {
  double most = 0;
  for (int r = 0; r + 1 < sheet.rows; ++r) {
    for (int c = 0; c + 1 < sheet.cols; ++c) {
      const auto at = [&](int row, int col) { return sheet.find({row, col})->point_in_world; };
      const Vector3d twist = at(r, c) - at(r, c + 1) - at(r + 1, c) + at(r + 1, c + 1);
      most = std::max(most, twist.norm() / 16);
    }
  }
  return most;
}

TEST(StaticSolver, RestsOnASlipperyCubeAsTheCheckerAgrees) {
  const Print print = read_print(lying_scene("C").print_file);
  const Scene scene = slippery_cube(print);
  for (const int grid : {15, 21}) {
    const SimulateOptions options = options_of(grid, Solver::newton);
    const SimulateResult result =
        simulate_checked(scene, read_fabric(scene.fabric_file), print, std::nullopt, options);
    EXPECT_EQ(result.report.status, RestStatus::at_rest) << grid << ": " << result.report.sentence;
    EXPECT_FALSE(result.contact_forces.empty()) << grid;
    EXPECT_LT(result.report.deepest_between_m, triangles_off_cells(result.sheet) + 1e-6) << grid;
  }
}

TEST(StaticSolver, TooFewIterationsAreNotCalledRest) {
  const Scene scene = lying_scene("C");
  SimulateOptions options;
  options.rows = options.cols = 11;
  options.solver = Solver::newton;
  options.max_steps = 5;
  const SimulateResult result = simulate(scene, read_fabric(scene.fabric_file),
                                         read_print(scene.print_file), std::nullopt, options);
  EXPECT_EQ(result.report.status, RestStatus::step_limit);
  EXPECT_GT(result.report.residual, 1e-6);
  EXPECT_EQ(std::get<SimulatedSource>(result.sheet.source).status, result.report.sentence);
}

/// Moves a sheet by Runge-Kutta, velocities zeroed at peaks of kinetic energy, until it rests.
void bring_to_rest(Motion& motion, double residual) {
  double before = 0;
  bool rising = false;
  for (int step = 0; step < 200000; ++step) {
    motion.step(motion.stable_step_s(0.9));
    const double kinetic = motion.kinetic_energy_j();
    if (kinetic < before && rising && step > 2000) motion.stop();
    rising = kinetic > before;
    before = kinetic;
    if (step % 100 != 0 || kinetic >= 1e-13 || motion.residual() >= residual) continue;
    motion.seek_contacts();
    if (motion.residual() < residual) return;
  }
  ADD_FAILURE() << "not at rest: " << motion.residual();
}

/// The largest displacement of a particle when the static solver starts from the rest of
/// Runge-Kutta.
double moved_from_runge_kutta_rest_m(const std::string& name, int side) {
  const Scene scene = lying_scene(name);
  const Fabric fabric = read_fabric(scene.fabric_file);
  const Print print = read_print(scene.print_file);
  const GridSpec grid{side, side, print.patch_m};
  SimulateReport ignored;
  ClothLaws laws = make_laws(fabric, 1, ignored);
  laws.stretch_damping_s = 1e-5;
  Cloth cloth(grid, laws, MassRule::area);
  const Surroundings surroundings(scene);
  Motion motion(cloth, surroundings, {.damping_per_s = 20, .friction = scene.friction});
  motion.position =
      make_start(scene, print, grid, std::nullopt, surroundings.top_z_m(), 1e-6).position;
  bring_to_rest(motion, 1e-5);
  StaticOptions how;
  how.friction = scene.friction;
  how.first_step_s = 10;
  StaticSolver solver(cloth, surroundings, how);
  solver.position = motion.position;
  solver.contacts().take_springs(motion.line_contacts(), motion.position);
  solver.rest_on_contacts(2e-7);
  const StaticReport report = solver.solve();
  EXPECT_EQ(report.status, StaticStatus::at_rest);
  EXPECT_LE(report.residual, 1e-6);
  return distance_m(solver.position, motion.position);
}

TEST(StaticSolver, RestOfRungeKuttaStaysRest) {
  for (const char* name : {"A", "C"}) {
    const double moved_m = moved_from_runge_kutta_rest_m(name, 11);
    RecordProperty(std::string("moved_um_") + name, std::to_string(moved_m * 1e6));
    EXPECT_LT(moved_m, 0.01 * mm) << name;
  }
}

TEST(StaticSolver, HostileScenesNeitherCrashNorLie) {
  const Scene usual = lying_scene("A");
  std::vector<Scene> scenes;
  scenes.push_back(usual);  // nothing to lie on but the table far below
  scenes.back().obstacles.clear();
  scenes.push_back(usual);  // no friction: slides off
  scenes.back().friction = 0;
  scenes.push_back(usual);  // a needle
  scenes.back().obstacles = {Sphere{Vector3d(0, 0, 0.08), 1e-3}};
  scenes.push_back(usual);  // no gravity
  scenes.back().gravity_m_per_s2.setZero();
  scenes.push_back(usual);  // sideways gravity
  scenes.back().gravity_m_per_s2 = Vector3d(-50, 0, 0);
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    SimulateOptions options;
    options.rows = options.cols = 9;
    options.solver = Solver::newton;
    options.max_steps = 150;
    const SimulateResult result = simulate(scenes[k], read_fabric(usual.fabric_file),
                                           read_print(usual.print_file), std::nullopt, options);
    for (const SheetMark& mark : result.sheet.marks) {
      ASSERT_TRUE(mark.point_in_world.allFinite()) << "scene " << k;
    }
    if (result.report.status == RestStatus::at_rest) {
      EXPECT_LE(result.report.residual, 1e-6) << "scene " << k;
    }
  }
}

/// The cloth over the bench's cube, by a solver that stalls after so many iterations in vain.
StaticDrape over_the_cube(Falls falls, int patience) {
  const Scene scene = lying_scene("C");
  const Fabric fabric = read_fabric(scene.fabric_file);
  const Print print = read_print(scene.print_file);
  const GridSpec grid{25, 25, print.patch_m};
  SimulateOptions options;
  options.rows = options.cols = 25;
  options.solver = Solver::fall;
  const Surroundings surroundings(scene);
  SimulateReport report;
  const ClothLaws laws = make_laws(fabric, options.segments, report);
  const std::optional<Sheet> nothing;
  StaticOptions how = static_options(scene, options);
  how.falls = falls;
  how.patience = patience;
  return drape_statically({scene, print, nothing, surroundings, laws}, grid, how);
}

// A solver without patience stalls on its path to rest, as one with patience does on few drapes.
TEST(StaticSolver, FallsOnWhereItStalls) {
  const auto energy_j = [](const StaticDrape& drape) {
    return drape.report.history.back().sum_j();
  };
  const StaticDrape patient = over_the_cube(Falls::never, 50);
  ASSERT_EQ(patient.report.status, StaticStatus::at_rest);
  ASSERT_EQ(over_the_cube(Falls::never, 6).report.status, StaticStatus::stalled);
  const StaticDrape fell_on = over_the_cube(Falls::where_stalled, 6);
  EXPECT_EQ(fell_on.report.status, StaticStatus::at_rest);
  EXPECT_GE(fell_on.report.fell_on, 1);
  EXPECT_NEAR(energy_j(fell_on), energy_j(patient), 1e-4 * energy_j(patient));
}

TEST(StaticSolver, FallsOnNoMoreThanThreeTimes) {
  const StaticDrape vain = over_the_cube(Falls::where_stalled, 1);
  EXPECT_EQ(vain.report.status, StaticStatus::stalled);
  EXPECT_EQ(vain.report.fell_on, 3);
}

TEST(Prolong, KeepsCubicSheets) {
  const GridSpec coarse{8, 6, {0.2, 0.1}};
  const GridSpec fine{15, 21, {0.2, 0.1}};
  const auto sheet = [](const GridSpec& grid) {
    const int n = grid.count();
    Field x(3 * static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) {
      const double u = int{i / grid.cols} * grid.warp_spacing_m();
      const double v = (i % grid.cols) * grid.weft_spacing_m();
      x[i] = u;
      x[n + i] = v + u * u * v;
      x[2 * n + i] = 3 * u * u * u - v * v * v + u * v;
    }
    return x;
  };
  EXPECT_LT(distance_m(prolong(sheet(coarse), coarse, fine), sheet(fine)), 1e-15);
}

std::string sizes_of(const std::vector<GridSpec>& levels) {
  std::string all;
  for (const GridSpec& grid : levels)
    all += std::to_string(grid.rows) + "x" + std::to_string(grid.cols) + " ";
  return all;
}

TEST(StaticLevels, HalveAndGoGentlyToLargeGrids) {
  const auto levels = [](int rows, int cols) {
    return sizes_of(static_levels(GridSpec{rows, cols, {0.2, 0.2}}));
  };
  EXPECT_EQ(levels(31, 31), "31x31 ");
  EXPECT_EQ(levels(61, 61), "31x31 61x61 ");
  EXPECT_EQ(levels(101, 101), "26x26 51x51 72x72 101x101 ");
  EXPECT_EQ(levels(101, 51), "51x26 72x36 101x51 ");
  EXPECT_EQ(levels(201, 201), "26x26 51x51 72x72 101x101 142x142 201x201 ");
  EXPECT_EQ(levels(201, 101), "51x26 72x36 101x51 142x72 201x101 ");
}

}  // namespace
}  // namespace drape::simulate
