// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "simulate/cloth/cloth.hpp"

namespace drape::simulate {

/// How near a sheet comes to itself. Each cell counts as two triangles; of triangles less than
/// three grid steps apart along the sheet no distance counts, but that they pass through each other
/// does.
struct SelfDistance {
  std::optional<double> least_m;  ///< absent: nothing is nearer than one grid spacing
  int crossings = 0;              ///< pairs of triangles that pass through each other
};
[[nodiscard]] SelfDistance self_distance(const GridSpec& grid, const Field& position);
/// Whether there are crossings, at less cost.
[[nodiscard]] bool passes_through_itself(const GridSpec& grid, const Field& position);

}  // namespace drape::simulate
