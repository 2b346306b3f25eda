// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/ensemble/branches.hpp"
#include "tests/support/paths.hpp"

/// Drapes of bench1 for tests of ensembles.
namespace drape::simulate::test {

/// A scene of bench1 that starts flat, 3 mm above its objects and beside their centre.
[[nodiscard]] inline Scene lying(const std::string& name) {
  Scene scene = read_scene(drape::test::source_root() / "rigs/bench1/scenes" / (name + ".toml"));
  scene.start = {StartMode::flat, 0,
                 Eigen::Vector3d(0.005, -0.004, Surroundings(scene).top_z_m() + 0.003), 0.2};
  return scene;
}

/// Bench1's cube with an edge radius of 30 mm, which meshes of 20 mm can follow.
[[nodiscard]] inline Scene on_round_box() {
  Scene scene = lying("C");
  std::get<Box>(scene.obstacles.front()).edge_radius_m = 30 * units::mm;
  return scene;
}

/// A case on meshes of 20 and 10 mm, with one line per curve and no sheet that positions it.
[[nodiscard]] inline EnsembleCase coarse_case(const Scene& scene, bool internal_friction = false) {
  SimulateOptions options;
  options.segments = 1;
  options.internal_friction = internal_friction;
  options.drape.coarsest_m = 20 * units::mm;
  options.drape.spacing_m = 10 * units::mm;
  return ensemble_case(scene, read_fabric(scene.fabric_file), read_print(scene.print_file),
                       std::nullopt, options);
}

}  // namespace drape::simulate::test
