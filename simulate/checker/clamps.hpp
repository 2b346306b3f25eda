// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/checker/sheet.hpp"

namespace drape::simulate::checker {

/// What the clamps of a scene do to a sheet.
struct Clamps {
  std::vector<HalfTriple> halves;
  std::vector<Support> supports;  ///< each clamped particle once, held in every direction
  Real farthest_m = 0;            ///< largest distance of a clamped particle from its place
  Real turned_rad = 0;            ///< largest angle of a first edge, across the clamp, to `forward`
  std::vector<std::string> refusals;
};

/// Every particle of the sheet that lies on a clamp's line in the material. A line that is on no
/// row of particles is refused: the sheet's free length begins elsewhere.
[[nodiscard]] Clamps clamps_of(const Scene& scene, const Sheet& sheet,
                               const std::vector<Point>& points);

}  // namespace drape::simulate::checker
