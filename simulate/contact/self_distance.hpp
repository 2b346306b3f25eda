// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace drape::simulate {

/// Smallest distance of a sheet of triangles from itself. Distances between triangles less than
/// three steps apart along the sheet do not count, but their intersections do.
struct SelfDistance {
  std::optional<double> least_m;  ///< absent if nothing is closer than one step
  int crossings = 0;              ///< pairs of triangles that intersect
};
/// `material_m`: material coordinates (warp, weft) of corners; `step_m`: a step along the sheet.
[[nodiscard]] SelfDistance self_distance(const std::vector<std::array<int, 3>>& facets,
                                         const std::vector<Eigen::Vector2d>& material_m,
                                         double step_m, const std::vector<Eigen::Vector3d>& places);
/// True if there are intersections; cheaper than counting them.
[[nodiscard]] bool passes_through_itself(const std::vector<std::array<int, 3>>& facets,
                                         const std::vector<Eigen::Vector3d>& places);

}  // namespace drape::simulate
