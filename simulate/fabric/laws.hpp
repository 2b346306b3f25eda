// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "simulate/fabric/curve.hpp"
#include "simulate/fabric/memory.hpp"

namespace drape::simulate {

/// Constitutive laws of a fabric in SI units. Index 0 is warp, 1 weft.
struct ClothLaws {
  double density_kg_per_m2 = 0;
  ForceCurve tensile[2];  ///< N/m as a function of strain
  ForceCurve shear;       ///< N/m as a function of angle in rad, odd
  ForceCurve bending[2];  ///< N as a function of curvature in 1/m, odd
  double twist_n_m = 0;   ///< J in the energy per area 1/2 J kappa12^2
  std::optional<ClothFriction> friction = std::nullopt;  ///< absent if the cloth has no memory
};

/// Energies of a cloth's elements (J), by kind.
struct InternalEnergies {
  double stretch_j = 0, shear_j = 0, bending_j = 0, twist_j = 0;
  [[nodiscard]] double sum_j() const { return stretch_j + shear_j + bending_j + twist_j; }
};

}  // namespace drape::simulate
