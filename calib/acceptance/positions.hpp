// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/acceptance/acceptance.hpp"
#include "calib/joint/model.hpp"
#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// A point of the target in space, with what its uncertainty comes from.
struct MeasuredPoint {
  Eigen::Vector3d in_world_mm;
  Eigen::Matrix3d noise_mm2;           ///< from the detections' covariances
  Eigen::Matrix3Xd by_calibration_mm;  ///< by the cameras' parameters, as in joint_covariance
};

/// All points of a set that two or more calibrated cameras saw (least squares on distorted pixels).
/// Their derivatives by the cameras' parameters stand in the order of the calibration.
[[nodiscard]] std::map<MarkId, MeasuredPoint> measured_points(const Detections& detections,
                                                              const Calibration& calibration,
                                                              const std::string& set);

/// The measured plate, as its target file and its stated bow describe it.
struct Plate {
  Target target;
  Board bow;

  /// `bow_mm`: how far its edges stand above its middle along x and y.
  Plate(Target described, const Eigen::Vector2d& bow_mm);
  [[nodiscard]] Eigen::Vector3d point(MarkId mark) const {
    return bow.bent(target.point_in_target(mark));
  }
};

/// The plate as it lay for one set.
struct Position {
  std::string set;
  std::map<MarkId, MeasuredPoint> points;
  WorldFromTarget pose;  ///< nearest to the points
};

/// Names of the sets, in the order of the file.
[[nodiscard]] std::vector<std::string> sets_of(const Detections& detections);

/// The plate at every set that shows four or more of its points to two calibrated cameras.
[[nodiscard]] std::vector<Position> positions_of(const Detections& detections,
                                                 const Calibration& calibration,
                                                 const Plate& plate);

/// Counts the positions that are places of their own. Nearer to an earlier one than half the
/// plate's pitch (mean of its points) it is that place again: each point is then still nearest to
/// where it was, and no other part of the volume is tested.
[[nodiscard]] int count_places(const std::vector<const Position*>& positions, const Plate& plate);

/// The same detections with each dot's centroid moved to the image of its centre (Heikkila 2000),
/// for the positions that are known; corners stay.
[[nodiscard]] Detections without_eccentricity(Detections detections, const Calibration& calibration,
                                              const Plate& plate,
                                              const std::vector<Position>& positions);

/// The calibrating detections, as the record beside calibration.json names them; `tested`: the
/// detections that are to be measured, known by their content too.
[[nodiscard]] CalibrationEvidence detections_behind(const std::filesystem::path& calibration,
                                                    const std::filesystem::path& tested);

}  // namespace drape::calib
