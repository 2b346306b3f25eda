// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "simulate/cloth/cloth.hpp"

namespace drape::simulate {

// Which pieces of a sheet are two layers, also beside each other: a particle and a triangle, or two
// edges, `firsts` (1 or 2) of the four particles the first one's. What has a particle in common
// meets there, and what lies in one cell is kept apart by the cell's own shape.

/// True if two pieces have no particle in common and do not lie in one cell.
[[nodiscard]] bool are_two_layers(const GridSpec& grid, const std::array<int, 4>& particle,
                                  int firsts);

/// Distance that two layers keep (m): `thickness_m`, and where a grid step joins them no more than
/// a quarter of the spacing, for a sheared cell is not folded.
[[nodiscard]] double layers_apart_m(const GridSpec& grid, const std::array<int, 4>& particle,
                                    int firsts, double thickness_m);

/// True if two cells, named by their first particles, have a particle in common.
[[nodiscard]] bool are_neighbours(const GridSpec& grid, int one, int two);

/// Lower bound of the distance (m) of two layers in neighbouring cells. Positive where the sheet is
/// bent by less than about 40 degrees from cell to cell, so that most need no closer look.
[[nodiscard]] double least_apart_m(const GridSpec& grid, const Field& position, int one, int two);

}  // namespace drape::simulate
