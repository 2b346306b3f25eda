// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::triangulate {

/// A mark that one camera alone sees: it lies on that ray, within a length of cloth of a measured
/// neighbour, and nothing stands before it.
struct SightLine {
  MarkId mark;
  Eigen::Vector3d camera_in_world, direction;  ///< direction: unit
  const SheetMark* neighbour = nullptr;
  double cloth_m = 0;  ///< longest length along the cloth to the neighbour
};

/// All of a set, a line for each measured neighbour along warp and weft. `most_strain` as in
/// contradictions_of_pitch().
[[nodiscard]] std::vector<SightLine> sight_lines_of(const Detections& detections,
                                                    const Calibration& calibration,
                                                    const std::string& set, const Sheet& sheet,
                                                    double most_strain);

/// By how much the object hides every place on the line that the cloth can reach:
/// the least, over these places, of their depth in the object, the lack of cloth to pass outside it
/// and the depth of the line of sight in it. 0 where one place is free.
[[nodiscard]] double shortfall_m(const Obstacle& object, const SightLine& line);

}  // namespace drape::triangulate
