// SPDX-License-Identifier: Apache-2.0
// A 20 cm patch of fabric A on the 9 cm sphere of scene A, from a flat start 3 mm above it, to
// rest at 1e-6 of a particle's weight on two threads (time is wall time, CPU that of the process);
// baseline: Runge-Kutta, to 1e-3.
#include <benchmark/benchmark.h>

#include <optional>

#include "simulate/objects/surroundings.hpp"
#include "simulate/simulate.hpp"
#include "tests/support/paths.hpp"

namespace {

void drape_over_sphere(benchmark::State& state, const char* solver) {
  const std::filesystem::path bench = drape::test::source_root() / "rigs/bench1";
  drape::Scene scene = drape::read_scene(bench / "scenes/A.toml");
  const drape::simulate::Surroundings objects(scene);
  scene.start.mode = drape::StartMode::flat;
  scene.start.centre_in_world = Eigen::Vector3d(0.005, -0.004, objects.top_z_m() + 0.003);
  scene.start.yaw_rad = 0.2;
  const drape::Fabric fabric = drape::read_fabric(scene.fabric_file);
  drape::Print print = drape::read_print(scene.print_file);
  print.patch_m = {0.2, 0.2};
  drape::SimulateOptions options;
  options.rows = options.cols = static_cast<int>(state.range(0));
  options.segments = 1;
  options.solver = solver;
  options.threads = 2;
  for (auto _ : state) {
    const drape::SimulateResult result = simulate(scene, fabric, print, std::nullopt, options);
    state.counters["at_rest"] = result.report.status == drape::RestStatus::at_rest;
    state.counters["residual"] = result.report.residual;
    state.counters["steps"] = static_cast<double>(result.report.steps);
    state.counters["energy_uJ"] = result.report.energy_end_j / 1e-6;
  }
}

BENCHMARK_CAPTURE(drape_over_sphere, static_solver, "static")
    ->Arg(21)
    ->Arg(31)
    ->Arg(61)
    ->Arg(101)
    ->Arg(201)
    ->Iterations(1)
    ->Unit(benchmark::kSecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK_CAPTURE(drape_over_sphere, runge_kutta, "rk4")
    ->Arg(21)
    ->Arg(31)
    ->Iterations(1)
    ->Unit(benchmark::kSecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

}  // namespace
