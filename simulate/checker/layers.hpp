// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "simulate/checker/sheet.hpp"

/// The checker's own view of a sheet that lies on itself, in long double.
namespace drape::simulate::checker {

/// Pairs of an edge of one cell and a triangle of another, at least three cells away along the
/// warp or the weft, that pass through each other.
[[nodiscard]] int crossings_of(const std::vector<Point>& points, int rows, int cols);

/// Particles near triangles and edges near edges of another layer, at most `near_m` apart, as
/// supports that push them apart: positive weights on one layer, negative ones on the other.
[[nodiscard]] std::vector<Support> layer_supports_of(const std::vector<Point>& points, int rows,
                                                     int cols, Real near_m);

}  // namespace drape::simulate::checker
