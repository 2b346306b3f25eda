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

/// Views of one mark of the lattice, before it is triangulated.
struct MarkViews {
  MarkId mark;
  std::vector<View> views;           ///< ordered like the frames
  std::vector<std::string> refused;  ///< "cam1 rejected it: bad fit"
};

/// Columns of each camera in the calibration's joint covariance; empty if it has none. Refers to
/// the calibration. Throws Error(bad_input) if a camera has no parameters there.
using JointPlaces = std::map<std::string, InJointCovariance>;
[[nodiscard]] JointPlaces joint_places(const Calibration& calibration);

/// All marks of the lattice, row-major, with the views of a set; these refer to the calibration
/// and the columns. Adds the floor to each detection's covariance. Throws Error(bad_input) if the
/// set is unknown, a camera is not calibrated or has another image size, or a number is not
/// finite.
[[nodiscard]] std::vector<MarkViews> collect_views(const Detections& detections,
                                                   const Calibration& calibration,
                                                   const JointPlaces& places,
                                                   const std::string& set, double floor_px);

/// A camera that faces the printed side of a mark without a point.
struct Looker {
  std::string camera;
  double angle_deg = 0;  ///< angle from the normal of the printed side
};

/// Cameras that face the printed side of a mark without a point and have it within their image,
/// judged by the plane through measured marks up to two steps away; occlusion is not considered.
/// nullopt if these marks do not determine a plane.
[[nodiscard]] std::optional<std::vector<Looker>> lookers_at(
    MarkId mark, const std::vector<SheetMark>& placed,
    const std::vector<const CalibratedCamera*>& cameras);

/// Reason for a gap with fewer than two views, such as "seen by one camera, measured by none: cam0
/// at 71 degrees".
[[nodiscard]] std::string too_few_views(const MarkViews& mark,
                                        const std::optional<std::vector<Looker>>& lookers);

}  // namespace drape::triangulate
