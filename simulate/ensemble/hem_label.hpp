// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "simulate/drape/level.hpp"

namespace drape::simulate {

/// Folds of a cloth's border: its horizontal distance from the vertical through the cloth's middle
/// of mass, over the fraction of the border's length in the cloth.
struct HemLabel {
  int nodes = 0;                        ///< folds: maxima that stand out by 3 mm
  std::array<double, 9> amplitude_m{};  ///< Fourier amplitudes 0 .. 8 of that distance
};

/// Reads the border of the surface at 256 places.
[[nodiscard]] HemLabel label_hem(const DrapeLevel& level, const ClothMoment& moment);

}  // namespace drape::simulate
