// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/rig.hpp"
#include "simulate/fabric/laws.hpp"

/// A fabric and a print for tests of pieces.
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

}  // namespace drape::simulate
