// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "simulate/checker/scene.hpp"

namespace drape::simulate::checker {

/// Places where the edges and corners of meshes, and of boxes without edge radius, may press on the
/// sheet, cut into two triangles per cell: edge against edge of the sheet, corner against triangle,
/// nearer than `touch_m`.
[[nodiscard]] std::vector<Support> edge_supports_of(const Objects& objects,
                                                    const std::vector<Point>& points, int rows,
                                                    int cols, Real touch_m);

}  // namespace drape::simulate::checker
