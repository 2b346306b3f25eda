// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "simulate/checker/sheet.hpp"
#include "simulate/objects/contact_forces.hpp"

/// The checker's own view of a sheet that lies on itself, in long double.
namespace drape::simulate::checker {

/// Pairs of an edge of one cell and a triangle of another, at least two cells away along the warp
/// or the weft, that pass through each other.
[[nodiscard]] int crossings_of(const std::vector<Point>& points, int rows, int cols);

/// Particles near triangles and edges near edges of another layer, at most `near_m` apart, as
/// supports that push them apart: positive weights on one layer, negative ones on the other.
[[nodiscard]] std::vector<Support> layer_supports_of(const std::vector<Point>& points, int rows,
                                                     int cols, Real near_m);

/// Adds the stated force (N) of one layer of the sheet on another to `sum`, and its opposite to
/// that one, as far as contact can do it: pressing along the line between the two places, with what
/// friction adds across. False where the places are not two points of a particle and a triangle or
/// of two edges, at least two grid steps apart along the sheet, that are nearest to each other and
/// at most `near_m` apart.
bool add_stated_layers(const std::vector<Point>& points, int cols, Real friction, Real near_m,
                       const ContactForce& stated, std::vector<Point>& sum);

}  // namespace drape::simulate::checker
