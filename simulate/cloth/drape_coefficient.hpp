// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/scene.hpp"
#include "simulate/cloth/cloth.hpp"

namespace drape::simulate {

/// Area of the sheet's shadow straight down (m^2), counted on squares of `pixel_m`.
[[nodiscard]] double shadow_area_m2(const GridSpec& grid, const Field& position, double pixel_m);

/// Drape coefficient of a round specimen on the disc of a drapemeter: (shadow - disc) / (specimen -
/// disc) with the area that the cells make up as the specimen's (Cusick 1968). Absent unless the
/// grid is round and the scene's only object is an upright cylinder smaller than the specimen.
[[nodiscard]] std::optional<double> drape_coefficient(const GridSpec& grid, const Field& position,
                                                      const Scene& scene);

}  // namespace drape::simulate
