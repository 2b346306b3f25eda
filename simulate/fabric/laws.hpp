// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "simulate/fabric/curve.hpp"
#include "simulate/fabric/memory.hpp"

namespace drape::simulate {

/// Laws of a fabric in SI. Index 0 warp, 1 weft.
struct ClothLaws {
  double density_kg_per_m2 = 0;
  ForceCurve tensile[2];  ///< N/m over strain
  ForceCurve shear;       ///< N/m over rad, odd
  ForceCurve bending[2];  ///< N over 1/m, odd
  double twist_n_m = 0;   ///< J of the energy 1/2 J kappa12^2 per area
  std::optional<ClothFriction> friction = std::nullopt;  ///< absent: the cloth has no memory
};

/// Energies of a cloth's elements (J).
struct InternalEnergies {
  double stretch_j = 0, shear_j = 0, bending_j = 0, twist_j = 0;
  [[nodiscard]] double sum_j() const { return stretch_j + shear_j + bending_j + twist_j; }
};

}  // namespace drape::simulate
