// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/sheet.hpp"
#include "triangulate/point.hpp"

namespace drape::triangulate {

/// Views of one mark of the lattice before it is placed.
struct MarkViews {
  MarkId mark;
  std::vector<View> views;           ///< in the order of the frames
  std::vector<std::string> refused;  ///< "cam1 rejected it: bad fit"
};

/// Columns of each camera in the calibration's joint covariance; empty when it has none.
/// Points into the calibration. Throws Error(bad_input) when a camera has no parameter there.
using JointPlaces = std::map<std::string, InJointCovariance>;
[[nodiscard]] JointPlaces joint_places(const Calibration& calibration);

/// All marks of the lattice, row-major, with the views of a set, which point into the calibration
/// and the places. The floor is added to each
/// detection's covariance. Throws Error(bad_input) when the set is unknown, a camera is not
/// calibrated or has another image size, or a number is not finite.
[[nodiscard]] std::vector<MarkViews> collect_views(const Detections& detections,
                                                   const Calibration& calibration,
                                                   const JointPlaces& places,
                                                   const std::string& set, double floor_px);

/// A camera that looks at the printed face of a mark without a point.
struct Looker {
  std::string camera;
  double angle_deg = 0;  ///< from the face's normal
};

/// Cameras that have a mark without a point in their picture and look at its printed face, by the
/// plane through the placed marks up to two steps away; what may stand between is not asked.
/// Nothing where these marks determine no plane.
[[nodiscard]] std::optional<std::vector<Looker>> lookers_at(
    MarkId mark, const std::vector<SheetMark>& placed,
    const std::vector<const CalibratedCamera*>& cameras);

/// Reason for a mark with fewer than two views: "seen by one camera, measured by none: cam0 at 71
/// degrees".
[[nodiscard]] std::string too_few_views(const MarkViews& mark,
                                        const std::optional<std::vector<Looker>>& lookers);

}  // namespace drape::triangulate
