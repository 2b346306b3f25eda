// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/drape/drape.hpp"

/// A cloth and a scene for tests of drapes.
namespace drape::simulate {

inline ClothLaws cotton() {
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.15;
  laws.tensile[0] = laws.tensile[1] = {500, {}};
  laws.shear = {30, {}};
  laws.bending[0] = {10e-6, {}};
  laws.bending[1] = {7e-6, {}};
  laws.twist_n_m = 13e-6;
  return laws;
}

inline Print square_patch(double side_m) {
  Print print;
  print.rows = print.cols = 6;
  print.pitch_m = side_m / 6;
  print.patch_m = {side_m, side_m};
  print.margin_m = {side_m / 12, side_m / 12};
  return print;
}

/// A sphere of 60 mm on the table, with the centre of a cloth 1 mm above it.
inline Scene ball(double friction) {
  using units::mm;
  Scene scene;
  scene.file = "scene.toml";
  scene.name = "ball";
  scene.table_z_m = -60 * mm;
  scene.friction = friction;
  scene.obstacles = {Sphere{{0, 0, -30 * mm}, 30 * mm}};
  scene.start.mode = StartMode::flat;
  scene.start.centre_in_world = Eigen::Vector3d(0, 0, 1 * mm);
  return scene;
}

/// A square of 120 mm of that cotton.
inline DrapeCase case_of(const Scene& scene, std::optional<ClothOutline> outline = std::nullopt) {
  return drape_case(scene, square_patch(120 * units::mm), std::nullopt, cotton(),
                    std::move(outline));
}

inline double mean_distance_m(const Eigen::MatrixX3d& a, const Eigen::MatrixX3d& b) {
  return (a - b).rowwise().norm().mean();
}

}  // namespace drape::simulate
