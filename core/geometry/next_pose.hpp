// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/pose.hpp"
#include "core/rig.hpp"

namespace drape {

/// Box in the world frame (metres) in which cloths are measured.
struct WorldBox {
  Eigen::Vector3d low, high;
};

/// Nodes of a regular grid over the box, ends included.
[[nodiscard]] std::vector<Eigen::Vector3d> grid_of(const WorldBox& box, int nodes_per_side);

/// All points of the target in its frame, row after row.
[[nodiscard]] std::vector<Eigen::Vector3d> points_of(const Target& target);

/// Standard deviation of a measured point over the volume (metres): root mean square over a grid of
/// the points that two cameras or more see. A motion of all of them as one body is left out: the
/// world is where the first stage lies, whatever poses follow, and no shape depends on it.
struct PredictedError {
  double calibration_m = 0;  ///< from the calibration's joint covariance
  double marks_m = 0;        ///< from the noise of the marks' centres
};

/// A pose of the target that the operator may take next.
struct NextPose {
  WorldFromTarget world_from_target;
  double calibration_m = 0;  ///< predicted with it
  std::vector<int> cameras;  ///< cameras that see the whole target
  std::string words;         ///< "tilted by +30 deg about its x axis, centre at (40, 0, 60) mm"
  /// Outline of the target in each of them, px: a closed polygon.
  std::vector<std::vector<Eigen::Vector2d>> outline_px;
};

/// Predicts how a further view of the target would lower the error of measured points.
class PosePlanner {
 public:
  /// `points_in_target`: of a flat target; `sigma_px`: standard deviation of a mark's centre in
  /// each camera, along one axis. Throws Error(bad_input) when the calibration carries no joint
  /// covariance.
  PosePlanner(Calibration calibration, std::vector<Eigen::Vector3d> points_in_target,
              const WorldBox& volume, std::vector<double> sigma_px);

  /// True where two cameras see a point of the volume; without one nothing is predicted.
  [[nodiscard]] bool sees_volume() const { return !grid_.empty(); }
  [[nodiscard]] PredictedError now() const;
  /// The candidate that lowers calibration_m most; nothing when none lowers it. A candidate is seen
  /// whole by two cameras or more: tilts of 25 and 40 deg (so that perspective speaks for the lens)
  /// about x and y, at `places_per_side`^3 places, 2 or more a side, that reach three quarters of
  /// the distance to the volume's sides.
  [[nodiscard]] std::optional<NextPose> next(int places_per_side = 3) const;

 private:
  [[nodiscard]] double calibration_sd(const Eigen::MatrixXd& covariance) const;
  /// Information of a view of the target on all cameras' parameters, its own pose not known.
  [[nodiscard]] std::optional<Eigen::MatrixXd> information(const WorldFromTarget& pose,
                                                           std::vector<int>& cameras) const;
  [[nodiscard]] std::vector<std::vector<Eigen::Vector2d>> outlines(const NextPose& pose) const;

  Calibration calibration_;
  std::vector<Eigen::Vector3d> points_in_target_;
  std::vector<Eigen::Vector3d> corners_;  ///< corners of the target, around it
  WorldBox volume_;
  std::vector<double> sigma_px_;
  std::vector<Eigen::Index> offsets_;  ///< place of each camera among all parameters
  std::vector<Eigen::Vector3d> grid_;
  /// d points / d parameters of all grid points, without what moves them all as one body.
  Eigen::MatrixXd gains_;
  double marks_m_ = 0;
};

}  // namespace drape
