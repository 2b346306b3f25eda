// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::triangulate {

/// Standard deviation of a mark along its worst direction, or more; 0 where none is stated.
[[nodiscard]] double sigma_m(const SheetMark& mark);

/// Two neighbours along warp or weft, and the cloth between them.
struct ClothSpan {
  const SheetMark* from = nullptr;
  const SheetMark* to = nullptr;
  double cloth_m = 0;  ///< longest length along the cloth: material distance and strain
  double sigma_m = 0;  ///< standard deviation of the distance, from both marks
};

/// Neighbours of the lattice that are both measured. `most_strain` as in contradictions_of_pitch().
[[nodiscard]] std::vector<ClothSpan> spans_of(const Sheet& sheet, double most_strain);

/// Length of the shortest path between two points outside a sphere or over an edge of a box,
/// metres: a string that is pulled taut over it. Exact; the chord where that is free, near a box's
/// corners, and for other objects, so that it is never longer than the path.
[[nodiscard]] double taut_path_m(const Obstacle& object, const Eigen::Vector3d& from,
                                 const Eigen::Vector3d& to);

/// By how much the cloth of a span is too short to pass outside the object; 0 where it is not.
/// Cloth that is too long for its span without any object is not this object's fault.
[[nodiscard]] double shortfall_m(const Obstacle& object, const ClothSpan& span);

}  // namespace drape::triangulate
