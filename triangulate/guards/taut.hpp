// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::triangulate {

/// Upper bound of a mark's standard deviation in any direction; 0 if none is stated.
[[nodiscard]] double sigma_m(const SheetMark& mark);

/// Two neighbours along warp or weft, with the cloth between them.
struct ClothSpan {
  const SheetMark* from = nullptr;
  const SheetMark* to = nullptr;
  double cloth_m = 0;  ///< longest length along the cloth: material distance plus strain
  double sigma_m = 0;  ///< standard deviation of the distance due to both marks
};

/// Pairs of adjacent measured marks. `most_strain` as in contradictions_of_pitch().
[[nodiscard]] std::vector<ClothSpan> spans_of(const Sheet& sheet, double most_strain);

/// Length (m) of the shortest path between two points outside a sphere or over an edge of a box,
/// like a string pulled taut. Exact; falls back to the chord if that is free, near a box's corners,
/// and for other objects, so it never exceeds the true length.
[[nodiscard]] double taut_path_m(const Obstacle& object, const Eigen::Vector3d& from,
                                 const Eigen::Vector3d& to);

/// Length by which the cloth of a span is too short to pass outside the object; 0 if it is not. A
/// span that is too long even without an object is not held against this object.
[[nodiscard]] double shortfall_m(const Obstacle& object, const ClothSpan& span);

}  // namespace drape::triangulate
