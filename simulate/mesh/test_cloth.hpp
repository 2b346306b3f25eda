// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/fabric/laws.hpp"
#include "simulate/mesh/material_mesh.hpp"

/// Cloth for the tests of this room.
namespace drape::simulate {

/// Laws that are linear, or have kinks.
inline ClothLaws laws_of(bool straight) {
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.138;
  laws.tensile[0] = {2000, {}};
  laws.tensile[1] = {1500, {}};
  laws.shear = {30, {}};
  laws.bending[0] = {8e-6, {}};
  laws.bending[1] = {5e-6, {}};
  laws.twist_n_m = 9e-6;
  if (straight) return laws;
  laws.tensile[0].hinges = {{0.01, 3000}, {0.03, 5000}};
  laws.shear.hinges = {{0.05, 20}};
  laws.bending[0].hinges = {{20, -4e-6}};
  return laws;
}

/// An L shape with a round hole, 60 x 50 mm, on an irregular mesh.
inline MaterialMesh irregular_mesh(double spacing = 0.004, unsigned seed = 3) {
  ClothOutline outline;
  outline.outer = {{0, 0}, {0.06, 0}, {0.06, 0.02}, {0.035, 0.022}, {0.03, 0.05}, {0, 0.05}};
  outline.holes = {circle({0.015, 0.03}, 0.008, 16)};
  MeshOptions options;
  options.spacing_m = spacing;
  options.jitter = 0.35;
  options.smoothing = 0;
  options.seed = seed;
  return triangulated(outline, options);
}

}  // namespace drape::simulate
