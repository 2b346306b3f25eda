// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/geometry/point.hpp"
#include "core/sheet.hpp"

namespace drape::triangulate {

/// Derivative of a pixel by unknowns common to all views of a mark, each scaled to a standard
/// deviation of 1; every view of the mark has the same number of columns.
using SharedUnknowns = Eigen::Matrix<double, 2, Eigen::Dynamic>;

/// Columns of a camera's parameters in the joint covariance of all cameras.
struct InJointCovariance {
  const Eigen::MatrixXd* covariance = nullptr;
  const Eigen::MatrixXd* target = nullptr;  ///< part due to the calibration target's error, if any
  std::vector<Eigen::Index> places;         ///< by parameter; -1 for a fixed one without error
};

/// Image of a mark in one camera.
struct View {
  const CalibratedCamera* camera = nullptr;
  Eigen::Vector2d px;
  Eigen::Matrix2d covariance_px2;
  Eigen::Vector2d semi_axes_px = Eigen::Vector2d::Zero();  ///< semi-axes of the dot's ellipse
  double axis_angle_rad = 0;                               ///< from +u towards the major axis
  /// Null if the cameras were calibrated separately, each with its own covariance.
  const InJointCovariance* joint = nullptr;
  SharedUnknowns shape_px = SharedUnknowns(2, 0);  ///< unknowns of the dot's shape; see dots.hpp

  /// Matrix of the dot's ellipse, px^2: squared semi-axes along its axes.
  [[nodiscard]] Eigen::Matrix2d shape_px2() const;
};

struct Point {
  PointStatus status = PointStatus::not_observable;
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();
  Eigen::Matrix3d detection_covariance_m2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d shape_covariance_m2 = Eigen::Matrix3d::Zero();  ///< due to the shared unknowns
  Eigen::Matrix3d calibration_covariance_m2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d target_covariance_m2 = Eigen::Matrix3d::Zero();  ///< due to the target
  std::vector<Eigen::Vector2d> residuals_px;  ///< measured minus projected, one per view
  double chi2 = 0;  ///< sum over the residuals, with all three covariances
  int degrees_of_freedom = 0;

  [[nodiscard]] Eigen::Matrix3d covariance_m2() const;
  [[nodiscard]] double rms_px() const;  ///< root mean square point distance
  /// Misfit of the views, converted to standard deviations of a normal variable.
  [[nodiscard]] double disagreement_sigmas() const;
};

/// Point nearest to all rays (midpoint method for N views); nullopt if the largest angle between
/// two rays is below the limit.
[[nodiscard]] std::optional<Eigen::Vector3d> midpoint(const std::vector<View>& views,
                                                      double min_angle_rad);

/// Weighted least squares on distorted pixels, starting at the midpoint (Gauss-Newton). The weight
/// is the inverse of the detections' covariance plus that of the shared unknowns, so that the views
/// help to determine these; the covariance of the point is (J'WJ)^-1 plus the contribution of the
/// calibration.
[[nodiscard]] Point solve_point(const std::vector<View>& views, double min_angle_rad);

struct AgreementLimits {
  double max_sigmas = 0, min_angle_rad = 0;  ///< see TriangulateOptions
  /// Limit (rms) below which three or more views are taken to see the same dot, whatever their
  /// sigmas; the covariance of the point is then widened to the scatter of the views. A sharp
  /// crease under a dot of 8 px radius shifts its image by up to 0.27 px between views at 15
  /// degrees, by up to 0.76 px at 60 degrees; a view of another dot, a pitch away, is off by 5.5
  /// px or more (three cameras tilted by 40 degrees, see agreement_test.cpp). The limit admits
  /// the gentle crease: a limit for sharp ones would also accept deviations that no crease
  /// explains.
  double shape_px = 0.3;
};

/// A point from the views that agree, or the reason why there is none.
struct Agreed {
  std::optional<Point> point;
  std::vector<std::size_t> used;       ///< indices of the views used
  std::optional<std::size_t> dropped;  ///< view left out because the others agree
  double disagreement_sigmas = 0;      ///< all views together
  std::string gap_reason;              ///< why there is no point
};

/// Triangulates the point from all views. If three or more disagree, drops the one view without
/// which the others agree, provided that there is only one such view.
[[nodiscard]] Agreed solve_with_agreement(const std::vector<View>& views,
                                          const AgreementLimits& limits);

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

}  // namespace drape::triangulate
