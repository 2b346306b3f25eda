// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/cloth/cloth.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// Length (m) by which a convex edge of a sharp solid stands through the sheet, 0 for none: where
/// an edge passes through one of a cell's two triangles, the distance from the sheet that the side
/// of it reaches which reaches less far, each at most one grid spacing long and not beyond another
/// passage. A needle's point that has pierced the sheet is seen so, where distances at places of
/// the sheet miss it; a sheet pressed a few micrometres into an edge counts with these. What stands
/// beyond the hem does not count. Spikes whose every edge is shorter than the depth they reach
/// through are underrated.
[[nodiscard]] double pierced_m(const GridSpec& grid, const Field& position,
                               const Surroundings& surroundings);

/// Length (m) by which a grid line of the sheet reaches over the rim of a body that it passes
/// through, in on one side and out on the opposite one; 0 for none. So a thin plate or disc is seen
/// that stands through the sheet, of which no place of the sheet is deep inside. At most the length
/// of that piece of line. Between grid lines a rim is not seen.
[[nodiscard]] double rim_through_m(const GridSpec& grid, const Field& position,
                                   const Surroundings& surroundings);

/// Depth of the sheet's flat pieces in a body, over the body's thickness there (the shortest
/// line through the deepest place along the normals about it; of a mesh its least extent along its
/// principal axes); the largest over all bodies narrower than a cell, 0 for none. Half is a body
/// whose middle the sheet passes through: a rod or wire so thin that no depth in it is beyond a
/// grid's tolerance.
[[nodiscard]] double through_part(const GridSpec& grid, const Field& position,
                                  const Surroundings& surroundings);

}  // namespace drape::simulate
