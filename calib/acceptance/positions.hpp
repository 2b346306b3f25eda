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

/// A measured point of the target, with the sources of its uncertainty.
struct MeasuredPoint {
  Eigen::Vector3d in_world_mm;
  Eigen::Matrix3d noise_mm2;           ///< contribution of the detections' covariances
  Eigen::Matrix3Xd by_calibration_mm;  ///< derivative by the cameras' parameters (joint_covariance)
};

/// All points of a set that at least two calibrated cameras saw (least squares on distorted
/// pixels), with derivatives by the cameras' parameters in the calibration's order.
[[nodiscard]] std::map<MarkId, MeasuredPoint> measured_points(const Detections& detections,
                                                              const Calibration& calibration,
                                                              const std::string& set);

/// The measured plate as described by its target file and stated bow.
struct Plate {
  Target target;
  Board bow;

  /// `bow_mm`: height of its edges above its centre along x and y.
  Plate(Target described, const Eigen::Vector2d& bow_mm);
  [[nodiscard]] Eigen::Vector3d point(MarkId mark) const {
    return bow.bent(target.point_in_target(mark));
  }
};

/// Pose and points of the plate in one set.
struct Position {
  std::string set;
  std::map<MarkId, MeasuredPoint> points;
  WorldFromTarget pose;  ///< best fit to the points
};

/// Names of the sets in the order of the file.
[[nodiscard]] std::vector<std::string> sets_of(const Detections& detections);

/// Position of the plate in each set in which two calibrated cameras see at least four points.
[[nodiscard]] std::vector<Position> positions_of(const Detections& detections,
                                                 const Calibration& calibration,
                                                 const Plate& plate);

/// Counts distinct positions. One that is closer to an earlier one than half the plate's pitch
/// (mean over its points) is a repetition: each point is then still nearest to its earlier place,
/// and no other part of the volume is tested.
[[nodiscard]] int count_places(const std::vector<const Position*>& positions, const Plate& plate);

/// Copies detections, shifting each dot's centroid to the image of its centre (Heikkila 2000) at
/// the known positions; corners stay unchanged.
[[nodiscard]] Detections without_eccentricity(Detections detections, const Calibration& calibration,
                                              const Plate& plate,
                                              const std::vector<Position>& positions);

/// Detections used for calibration, as named by the run record beside calibration.json. `tested`
/// are the detections to be measured, which are recognised by content as well.
[[nodiscard]] CalibrationEvidence detections_behind(const std::filesystem::path& calibration,
                                                    const std::filesystem::path& tested);

}  // namespace drape::calib
