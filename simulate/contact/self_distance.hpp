// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "simulate/cloth/cloth.hpp"

namespace drape::simulate {

/// Least distance of a sheet from itself. Each cell counts as two triangles; of triangles less than
/// three grid steps apart along the sheet no distance counts, but that they pass through each other
/// does.
struct SelfDistance {
  std::optional<double> least_m;  ///< absent: nothing is nearer than one grid spacing
  int crossings = 0;              ///< pairs of triangles that pass through each other
};
[[nodiscard]] SelfDistance self_distance(const GridSpec& grid, const Field& position);
/// True if there are crossings, at less cost.
[[nodiscard]] bool passes_through_itself(const GridSpec& grid, const Field& position);

/// The same of any triangles, by the flat places (warp, weft) of their corners; a step along the
/// sheet is `step_m`, which stands for the grid's spacing.
[[nodiscard]] SelfDistance self_distance(const std::vector<std::array<int, 3>>& facets,
                                         const std::vector<Eigen::Vector2d>& material_m,
                                         double step_m, const Field& position);
[[nodiscard]] bool passes_through_itself(const std::vector<std::array<int, 3>>& facets,
                                         const Field& position);

}  // namespace drape::simulate
