// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/camera_model.hpp"

namespace drape {

/// Half line in the world frame.
struct Ray {
  Eigen::Vector3d origin_m;
  Eigen::Vector3d direction;  ///< unit vector
};

/// Ray through a pixel. nullopt outside the valid range of the lens model.
[[nodiscard]] std::optional<Ray> ray_of(const Camera& camera, const Eigen::Vector2d& px);

/// Point with the least sum of squared distances to all rays (midpoint method for n views). nullopt
/// for fewer than two rays, or if no two of them enclose `min_angle_rad`.
[[nodiscard]] std::optional<Eigen::Vector3d> nearest_to_rays(const std::vector<Ray>& rays,
                                                             double min_angle_rad = 0);

/// Measured image of a point in a camera, with its covariance.
struct PixelView {
  const Camera* camera = nullptr;
  Eigen::Vector2d px;
  Eigen::Matrix2d covariance_px2;
};

enum class PointStatus {
  good,
  not_observable,  ///< fewer than two views, or nearly parallel rays
  not_converged,
  behind_a_camera,  ///< behind a camera, or outside the valid range of its lens model
};

/// A point reconstructed from n views. Pixel rows are ordered by view, two per view.
struct PointFit {
  PointStatus status = PointStatus::not_observable;
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();  ///< m
  Eigen::Matrix3Xd by_pixels;      ///< d point / d pixels, m/px; set, like the rest, if good
  Eigen::VectorXd residuals_px;    ///< measured minus projected
  Eigen::MatrixXd covariance_px2;  ///< covariance of the pixels, including the shared unknowns
};

/// Minimises the weighted squared residuals in distorted pixels by Gauss-Newton, starting at the
/// point nearest to the rays. The weight is the inverse of the pixels' covariance plus shared_px
/// shared_px', where `shared_px` (2n x k) holds the derivative of the pixels by k unknowns that all
/// views share, of standard deviation 1. A pixel error e moves the point by by_pixels e, so a pixel
/// covariance C gives the point the covariance by_pixels C by_pixels'.
[[nodiscard]] PointFit fit_point(const std::vector<PixelView>& views, double min_angle_rad,
                                 const Eigen::MatrixXd& shared_px = {});

}  // namespace drape
