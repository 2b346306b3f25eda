// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "simulate/drape/level.hpp"

namespace drape::simulate {

/// Folds of a cloth's hem: its horizontal distance from the vertical through the centre of mass, as
/// a function of the fraction of the hem's material length.
struct HemLabel {
  int nodes = 0;                        ///< number of maxima with a prominence of at least 3 mm
  std::array<double, 9> amplitude_m{};  ///< Fourier amplitudes 0 .. 8 of the distance
};

/// Samples the hem of the surface at 256 places.
[[nodiscard]] HemLabel label_hem(const DrapeLevel& level, const ClothMoment& moment);

}  // namespace drape::simulate
