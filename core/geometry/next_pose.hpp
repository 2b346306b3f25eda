// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/rig.hpp"

namespace drape {

/// Box in the world frame (metres) in which cloth is measured.
struct WorldBox {
  Eigen::Vector3d low, high;
};

/// Nodes of a regular grid over the box, including its faces.
[[nodiscard]] std::vector<Eigen::Vector3d> grid_of(const WorldBox& box, int nodes_per_side);

/// All points of the target in its frame, row by row.
[[nodiscard]] std::vector<Eigen::Vector3d> points_of(const Target& target);

/// Predicted standard deviation of a measured point in the volume (metres): root mean square over
/// the grid points that at least two cameras see. A common rigid motion of all points is excluded:
/// the first stage defines the world, and no shape depends on it.
struct PredictedError {
  double calibration_m = 0;  ///< from the calibration's joint covariance
  double marks_m = 0;        ///< from the noise of the marks' centres
};

/// A suggestion of the next target pose for the operator.
struct NextPose {
  WorldFromTarget world_from_target;
  double calibration_m = 0;  ///< predicted once this pose is added
  std::vector<int> cameras;  ///< cameras that see the whole target
  std::string words;         ///< "tilted by +30 deg about its x axis, centre at (40, 0, 60) mm"
  /// Outline of the target in each of these cameras, px, as a closed polygon.
  std::vector<std::vector<Eigen::Vector2d>> outline_px;
};

/// Predicts how much a further view of the target would reduce the error of measured points.
class PosePlanner {
 public:
  /// `points_in_target` must be coplanar; `sigma_px` is the standard deviation of a mark's centre
  /// along one axis, per camera. Throws Error(bad_input) if the calibration carries no joint
  /// covariance.
  PosePlanner(Calibration calibration, std::vector<Eigen::Vector3d> points_in_target,
              const WorldBox& volume, std::vector<double> sigma_px);

  /// True if at least two cameras see a point of the volume, as any prediction requires.
  [[nodiscard]] bool sees_volume() const { return !grid_.empty(); }
  [[nodiscard]] PredictedError now() const;
  /// The candidate pose that reduces calibration_m most; nullopt if none reduces it. Candidates are
  /// entirely visible to at least two cameras: tilts of 25 and 40 deg about x and y (perspective
  /// then constrains the lens), at `places_per_side`^3 positions (at least 2 per axis) that span
  /// three quarters of the volume's extent.
  [[nodiscard]] std::optional<NextPose> next(int places_per_side = 3) const;

 private:
  [[nodiscard]] double calibration_sd(const Eigen::MatrixXd& covariance) const;
  /// Information of a view of the target on all cameras' parameters; its own pose is unknown.
  [[nodiscard]] std::optional<Eigen::MatrixXd> information(const WorldFromTarget& pose,
                                                           std::vector<int>& cameras) const;
  [[nodiscard]] std::vector<std::vector<Eigen::Vector2d>> outlines(const NextPose& pose) const;

  Calibration calibration_;
  std::vector<Eigen::Vector3d> points_in_target_;
  std::vector<Eigen::Vector3d> corners_;  ///< corners of the target in cyclic order
  WorldBox volume_;
  std::vector<double> sigma_px_;
  std::vector<Eigen::Index> offsets_;  ///< index of each camera's first parameter
  std::vector<Eigen::Vector3d> grid_;
  /// d points / d parameters for all grid points, without their common rigid motion.
  Eigen::MatrixXd gains_;
  double marks_m_ = 0;
};

}  // namespace drape
