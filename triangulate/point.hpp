// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/calibration.hpp"

#include "core/geometry/point.hpp"

namespace drape::triangulate {

/// Derivative of a pixel by unknowns common to all views of a mark, each scaled to a standard
/// deviation of 1; as many columns in every view of the mark.
using SharedUnknowns = Eigen::Matrix<double, 2, Eigen::Dynamic>;

/// Columns of a camera's parameters in a covariance over all cameras.
struct InJointCovariance {
  const Eigen::MatrixXd* covariance = nullptr;
  std::vector<Eigen::Index> places;  ///< by parameter; -1: it was held fixed, its error is none
};

/// Image of a mark in one camera.
struct View {
  const CalibratedCamera* camera = nullptr;
  Eigen::Vector2d px;
  Eigen::Matrix2d covariance_px2;
  Eigen::Vector2d semi_axes_px = Eigen::Vector2d::Zero();  ///< axes of the dot's ellipse
  double axis_angle_rad = 0;                               ///< from +u to the major axis
  /// Absent: cameras calibrated apart, each with its own covariance.
  const InJointCovariance* joint = nullptr;
  SharedUnknowns shape_px =
      SharedUnknowns(2, 0);  ///< unknowns of the dot's shape, see dot_shape.hpp
};

struct Point {
  PointStatus status = PointStatus::not_observable;
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();
  Eigen::Matrix3d detection_covariance_m2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d shape_covariance_m2 = Eigen::Matrix3d::Zero();  ///< from the shared unknowns
  Eigen::Matrix3d calibration_covariance_m2 = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector2d> residuals_px;  ///< measured minus projected, by view
  double chi2 = 0;                            ///< residuals against all three covariances
  int degrees_of_freedom = 0;

  [[nodiscard]] Eigen::Matrix3d covariance_m2() const;
  [[nodiscard]] double rms_px() const;  ///< root mean square point distance
  /// Miss of the views, in standard deviations of a normal variable.
  [[nodiscard]] double disagreement_sigmas() const;
};

/// Point nearest to all rays (midpoint method for N views); nothing when the largest angle between
/// two rays is below the limit.
[[nodiscard]] std::optional<Eigen::Vector3d> midpoint(const std::vector<View>& views,
                                                      double min_angle_rad);

/// Weighted least squares on distorted pixels from the midpoint (Gauss-Newton). The weight is the
/// inverse of the detections' covariance together with that of the shared unknowns, so that the
/// views themselves tell of these what they can; the covariance of the point is (J'WJ)^-1 and the
/// calibration's part.
[[nodiscard]] Point solve_point(const std::vector<View>& views, double min_angle_rad);

}  // namespace drape::triangulate
