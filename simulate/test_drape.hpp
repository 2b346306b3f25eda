// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/support/judged_drape.hpp"

/// Drapes for tests.
namespace drape::simulate {

/// A scene of bench1 with its own flat start, 3 mm above its objects and beside their centre.
[[nodiscard]] inline Scene lying_scene(const std::string& name, double yaw_rad = 0.2) {
  Scene scene = read_scene(test::source_root() / "rigs/bench1/scenes" / (name + ".toml"));
  const double top_z_m = Surroundings(scene).top_z_m();
  scene.start = {StartMode::flat, 0, Eigen::Vector3d(0.005, -0.004, top_z_m + 0.003), yaw_rad};
  return scene;
}

/// Bench1's cloth A, hung by two marks of its upper hem.
[[nodiscard]] inline Scene hanging_scene() {
  Scene scene = lying_scene("A");
  scene.obstacles.clear();
  scene.start = {StartMode::flat, 0, Eigen::Vector3d(0, 0, 0.3), 0};
  scene.pins = {{{0, 0}, Eigen::Vector3d(-0.0775, 0.1, 0.3)},
                {{0, 10}, Eigen::Vector3d(0.0775, 0.1, 0.3)}};
  return scene;
}

/// Largest distance between marks of two sheets.
[[nodiscard]] inline double farthest_m(const Sheet& a, const Sheet& b) {
  double farthest = a.marks.size() == b.marks.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.marks.size(), b.marks.size()); ++i)
    farthest = std::max(farthest, (a.marks[i].point_in_world - b.marks[i].point_in_world).norm());
  return farthest;
}

/// Drape of the scene's own fabric and print from its own start.
[[nodiscard]] inline SimulateResult drape_of(const Scene& scene,
                                             const SimulateOptions& options = coarse_options()) {
  return simulate(scene, read_fabric(scene.fabric_file), read_print(scene.print_file), std::nullopt,
                  options);
}

}  // namespace drape::simulate
