// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/fabric/laws.hpp"

/// Laws for tests.
namespace drape::simulate {

/// Linear laws, equal along warp and weft.
[[nodiscard]] inline ClothLaws linear_laws(double density_kg_per_m2, double tensile_n_per_m,
                                           double shear_n_per_m, double bending_n_m,
                                           double twist_n_m = 0) {
  ClothLaws laws;
  laws.density_kg_per_m2 = density_kg_per_m2;
  laws.tensile[0] = laws.tensile[1] = {tensile_n_per_m, {}};
  laws.shear = {shear_n_per_m, {}};
  laws.bending[0] = laws.bending[1] = {bending_n_m, {}};
  laws.twist_n_m = twist_n_m;
  return laws;
}

/// A shirting with knots in all its curves.
[[nodiscard]] inline ClothLaws knotted_laws() {
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.138;
  laws.tensile[0] = {4000, {{0.004, 2500}, {0.01, 6000}}};
  laws.tensile[1] = {2000, {{0.006, 900}}};
  laws.shear = {34, {{0.05, -10}, {0.12, 8}}};
  laws.bending[0] = {7.7e-6, {{20, -2e-6}, {60, -1e-6}}};
  laws.bending[1] = {5.0e-6, {{30, -1e-6}}};
  laws.twist_n_m = 1.1e-5;
  return laws;
}

}  // namespace drape::simulate
