// SPDX-License-Identifier: Apache-2.0
#include "simulate/static_solver.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/units.hpp"
#include "simulate/motion.hpp"
#include "simulate/simulate.hpp"
#include "simulate/static_run.hpp"
#include "tests/support/paths.hpp"

namespace drape::sim {
namespace {

using Eigen::Vector3d;
using units::mm;

Scene bench_scene(const std::string& name) {
  Scene scene = read_scene(test::source_root() / "rigs/bench1/scenes" / (name + ".toml"));
  const Surroundings objects(scene);
  scene.start.mode = StartMode::flat;
  scene.start.centre_in_world = Vector3d(0.005, -0.004, objects.top_z_m() + 0.003);
  scene.start.yaw_rad = 0.2;
  return scene;
}

SimulateResult run(const Scene& scene, int grid, const std::string& solver, int segments = 1) {
  SimulateOptions options;
  options.rows = options.cols = grid;
  options.segments = segments;
  options.solver = solver;
  return simulate(scene, read_fabric(scene.fabric_file), read_print(scene.print_file), std::nullopt,
                  options);
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
    const SimulateResult result = run(bench_scene("A"), grid, "static");
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
  const Scene scene = bench_scene("A");
  const SimulateResult one = run(scene, 11, "static", 5);
  const SimulateResult two = run(scene, 11, "static", 5);
  for (std::size_t i = 0; i < one.sheet.marks.size(); ++i) {
    EXPECT_EQ(one.sheet.marks[i].point_in_world, two.sheet.marks[i].point_in_world);
  }
}

TEST(StaticSolver, PinnedSheetHangsAsByRungeKutta) {
  Scene scene = bench_scene("A");
  scene.obstacles.clear();
  scene.start = {StartMode::flat, 0, Vector3d(0, 0, 0.3), 0};
  scene.pins = {{{0, 0}, Vector3d(-0.0775, 0.1, 0.3)}, {{0, 10}, Vector3d(0.0775, 0.1, 0.3)}};
  const SimulateResult result = run(scene, 12, "static");
  EXPECT_EQ(result.report.status, RestStatus::at_rest) << result.report.sentence;
  EXPECT_LT(result.report.hold_error_m, 1e-8);
}

TEST(StaticSolver, TooFewIterationsAreNotCalledRest) {
  const Scene scene = bench_scene("C");
  SimulateOptions options;
  options.rows = options.cols = 11;
  options.solver = "static";
  options.max_steps = 5;
  const SimulateResult result = simulate(scene, read_fabric(scene.fabric_file),
                                         read_print(scene.print_file), std::nullopt, options);
  EXPECT_EQ(result.report.status, RestStatus::step_limit);
  EXPECT_GT(result.report.residual, 1e-6);
  EXPECT_EQ(std::get<SimulatedSource>(result.sheet.source).status, result.report.sentence);
}

/// How far the static solver goes from where Runge-Kutta came to rest.
double way_from_runge_kutta_rest_m(bool between_particles) {
  const Scene scene = bench_scene("A");
  const Fabric fabric = read_fabric(scene.fabric_file);
  const Print print = read_print(scene.print_file);
  SimulateOptions options;
  options.rows = options.cols = 11;
  options.segments = 1;
  options.residual_tolerance = 1e-5;
  options.contact_between_particles = between_particles;
  const SimulateResult moved = simulate(scene, fabric, print, std::nullopt, options);
  EXPECT_EQ(moved.report.status, RestStatus::at_rest) << moved.report.sentence;
  const GridSpec grid{11, 11, print.patch_m};
  Field rest(3 * static_cast<std::size_t>(grid.count()));
  for (int i = 0; i < grid.count(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      rest[static_cast<std::size_t>(axis) * grid.count() + i] =
          moved.sheet.marks[i].point_in_world[axis];
    }
  }
  SimulateReport ignored;
  Cloth cloth(grid, make_laws(fabric, 1, ignored), MassRule::area);
  const Surroundings surroundings(scene);
  StaticOptions how;
  how.friction = scene.friction;
  how.first_step_s = 10;
  how.contact_between_particles = between_particles;
  StaticSolver solver(cloth, surroundings, how);
  solver.position = rest;
  solver.lean(2e-7);
  const StaticReport report = solver.solve();
  EXPECT_EQ(report.status, StaticStatus::at_rest);
  EXPECT_LE(report.residual, 1e-6);
  return distance_m(solver.position, rest);
}

TEST(StaticSolver, RestOfRungeKuttaStaysRest) {
  const double way_m = way_from_runge_kutta_rest_m(false);
  RecordProperty("way_um", std::to_string(way_m * 1e6));
  EXPECT_LT(way_m, 0.01 * mm);
}

TEST(StaticSolver, FrictionBetweenParticlesStartsWithoutMemory) {
  // Runge-Kutta's friction springs between the particles are no part of a sheet of positions.
  // Without their pull the sheet settles within friction's band of equilibria.
  const double way_m = way_from_runge_kutta_rest_m(true);
  RecordProperty("way_um", std::to_string(way_m * 1e6));
  EXPECT_LT(way_m, 0.2 * mm);
}

TEST(StaticSolver, HostileScenesNeitherCrashNorLie) {
  const Scene usual = bench_scene("A");
  std::vector<Scene> scenes;
  scenes.push_back(usual);  // inside the sphere
  scenes.back().start.centre_in_world = Vector3d(0.004, -0.003, 0.03);
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
    options.solver = "static";
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

TEST(Prolong, KeepsCubicSheets) {
  const GridSpec coarse{8, 6, {0.2, 0.1}};
  const GridSpec fine{15, 21, {0.2, 0.1}};
  const auto sheet = [](const GridSpec& grid) {
    const int n = grid.count();
    Field x(3 * static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) {
      const double u = (i / grid.cols) * grid.warp_spacing_m();
      const double v = (i % grid.cols) * grid.weft_spacing_m();
      x[i] = u;
      x[n + i] = v + u * u * v;
      x[2 * n + i] = 3 * u * u * u - v * v * v + u * v;
    }
    return x;
  };
  EXPECT_LT(distance_m(prolong(sheet(coarse), coarse, fine), sheet(fine)), 1e-15);
}

}  // namespace
}  // namespace drape::sim
