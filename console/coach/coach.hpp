// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/pose.hpp"
#include "core/rig.hpp"

namespace drape::console {

/// Box in the world frame (metres) in which cloths are measured.
struct Volume {
  Eigen::Vector3d low, high;
};

/// The target measured in space with a given calibration, without using what is known of the
/// target; then its drawing moved onto the measured points. On a set that the calibration did not
/// use, `rms_m` is the error of a measured point.
struct MeasuredTarget {
  WorldFromTarget world_from_target;
  int points = 0;    ///< seen by two cameras or more
  double rms_m = 0;  ///< distance of a measured point from the drawing, root mean square
  std::vector<Eigen::Vector3d> points_in_world;
};

/// Nothing where fewer than 8 points are seen by two cameras.
[[nodiscard]] std::optional<MeasuredTarget> measure_target(
    const Calibration& calibration, const Target& target,
    const std::vector<FrameDetections>& frames);

/// Standard deviation of a measured point over the volume (metres): root mean square over a grid of
/// the points that two cameras or more see. What moves all of them as one body is left out: the
/// world is where the first stage lies, whatever poses follow, and no shape depends on it.
struct PredictedError {
  double calibration_m = 0;  ///< from the calibration's joint covariance
  double marks_m = 0;        ///< from the noise of the marks' centres
};

/// A pose of the target that the operator may take next.
struct NextPose {
  WorldFromTarget world_from_target;
  double calibration_m = 0;  ///< predicted with it
  std::vector<int> cameras;  ///< that see the whole target
  std::string words;         ///< "tilted by +30 deg about its x axis, centre at (40, 0, 60) mm"
  /// Outline of the target in each of them, px: a closed polygon.
  std::vector<std::vector<Eigen::Vector2d>> outline_px;
};

/// `sigma_px`: standard deviation of a mark's centre in each camera, along one axis.
/// Throws Error(bad_input) when the calibration carries no joint covariance.
class Coach {
 public:
  Coach(Calibration calibration, Target target, const Volume& volume, std::vector<double> sigma_px);

  [[nodiscard]] PredictedError now() const;
  /// The candidate that lowers calibration_m most; nothing when none lowers it. A candidate is seen
  /// whole by two cameras or more: tilts of 25 and 40 deg (so that perspective speaks for the lens)
  /// about x and y, at 27 places that reach three quarters of the distance to the volume's sides.
  [[nodiscard]] std::optional<NextPose> next() const;

 private:
  [[nodiscard]] double calibration_sd(const Eigen::MatrixXd& covariance) const;
  /// Information of a view of the target on all cameras' parameters, its own pose not known.
  [[nodiscard]] std::optional<Eigen::MatrixXd> information(const WorldFromTarget& pose,
                                                           std::vector<int>& cameras) const;
  [[nodiscard]] std::optional<Eigen::Vector2d> pixel(std::size_t camera,
                                                     const Eigen::Vector3d& point_in_world) const;

  Calibration calibration_;
  Target target_;
  Volume volume_;
  std::vector<double> sigma_px_;
  std::vector<Eigen::Index> offsets_;  ///< each camera's first among all parameters
  std::vector<Eigen::Vector3d> grid_;
  /// d points / d parameters of all grid points, without what moves them all as one body.
  Eigen::MatrixXd gains_;
  double marks_m_ = 0;
};

}  // namespace drape::console
