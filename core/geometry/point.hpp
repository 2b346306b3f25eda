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

/// Ray of a pixel. Nothing beyond the range of the lens model.
[[nodiscard]] std::optional<Ray> ray_of(const Camera& camera, const Eigen::Vector2d& px);

/// Point of least summed squared distance from all rays (midpoint method for n views). Nothing
/// below two rays, or where no two of them are `min_angle_rad` apart.
[[nodiscard]] std::optional<Eigen::Vector3d> nearest_to_rays(const std::vector<Ray>& rays,
                                                             double min_angle_rad = 0);

/// Image of a point in a camera, with its covariance.
struct PixelView {
  const Camera* camera = nullptr;
  Eigen::Vector2d px;
  Eigen::Matrix2d covariance_px2;
};

enum class PointStatus {
  good,
  not_observable,  ///< fewer than two views, or the rays are too parallel
  not_converged,
  behind_a_camera,  ///< or beyond the range of its lens model
};

/// A point from its n views. The rows of all pixels stand view after view, two each.
struct PointFit {
  PointStatus status = PointStatus::not_observable;
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();  ///< m
  Eigen::Matrix3Xd by_pixels;      ///< d point / d pixels, m/px; the fields below: where good
  Eigen::VectorXd residuals_px;    ///< measured minus projected
  Eigen::MatrixXd covariance_px2;  ///< covariance of the pixels, shared unknowns included
};

/// Weighted least squares on distorted pixels from the point nearest to the rays (Gauss-Newton).
/// The weight is the inverse of the pixels' covariance, to which `shared_px` adds unknowns of
/// standard deviation 1 that are common to all views (2n x k, derivative of the pixels). What an
/// error e of the pixels does to the point is by_pixels e, so that its covariance by a covariance C
/// of pixels is by_pixels C by_pixels'.
[[nodiscard]] PointFit fit_point(const std::vector<PixelView>& views, double min_angle_rad,
                                 const Eigen::MatrixXd& shared_px = {});

}  // namespace drape
