// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace drape::simulate {

/// Least distance of a sheet of triangles from itself. Of triangles less than three steps apart
/// along the sheet no distance counts, but that they pass through each other does.
struct SelfDistance {
  std::optional<double> least_m;  ///< absent: nothing is nearer than one step
  int crossings = 0;              ///< pairs of triangles that pass through each other
};
/// `material_m`: flat places (warp, weft) of the corners; `step_m`: a step along the sheet.
[[nodiscard]] SelfDistance self_distance(const std::vector<std::array<int, 3>>& facets,
                                         const std::vector<Eigen::Vector2d>& material_m,
                                         double step_m, const std::vector<Eigen::Vector3d>& places);
/// True if there are crossings, at less cost.
[[nodiscard]] bool passes_through_itself(const std::vector<std::array<int, 3>>& facets,
                                         const std::vector<Eigen::Vector3d>& places);

}  // namespace drape::simulate
