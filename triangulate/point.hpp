// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/calibration.hpp"

namespace drape {

/// Where one camera saw a mark.
struct View {
  const CalibratedCamera* camera = nullptr;
  Eigen::Vector2d px;
  Eigen::Matrix2d covariance_px2;
  Eigen::Vector2d semi_axes_px = Eigen::Vector2d::Zero();  ///< of the dot's ellipse
  double axis_angle_rad = 0;                               ///< from +u to the major axis
};

enum class PointStatus {
  good,
  not_observable,  ///< fewer than two views, or the rays are too parallel
  not_converged,
  behind_a_camera,  ///< or beyond the range of its lens model
};

struct Point {
  PointStatus status = PointStatus::not_observable;
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();
  Eigen::Matrix3d detection_covariance_m2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d calibration_covariance_m2 = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector2d> residuals_px;  ///< measured minus projected, by view
  double chi2 = 0;  ///< residuals against detection and calibration covariance
  int degrees_of_freedom = 0;

  [[nodiscard]] double rms_px() const;  ///< root mean square point distance
  /// How far the views miss each other, in standard deviations of a normal variable.
  [[nodiscard]] double disagreement_sigmas() const;
};

/// Point nearest to all rays (midpoint method for N views); nothing when the largest angle between
/// two rays is below the limit.
[[nodiscard]] std::optional<Eigen::Vector3d> midpoint(const std::vector<View>& views,
                                                      double min_angle_rad);

/// Weighted least squares on distorted pixels from the midpoint (Gauss-Newton), with the
/// covariance from the detections (J'WJ)^-1 and the share of the calibration's covariance.
[[nodiscard]] Point solve_point(const std::vector<View>& views, double min_angle_rad);

}  // namespace drape
