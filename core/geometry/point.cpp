// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/point.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace drape {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr int kMaxSteps = 30;
constexpr double kStepTolerance = 1e-13;  // m

/// Residuals and derivatives of all views at a trial point.
struct Linearised {
  MatrixXd jacobian;   ///< d pixels / d point, 2n x 3, px/m
  VectorXd residuals;  ///< measured minus projected, px
};

std::optional<Linearised> linearise(const std::vector<PixelView>& views, const Vector3d& in_world) {
  Linearised all{MatrixXd(2 * views.size(), 3), VectorXd(2 * views.size())};
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Camera& camera = *views[i].camera;
    const auto image = project(camera.model, camera.cam_from_world * in_world);
    if (!image) return std::nullopt;
    const auto row = 2 * static_cast<Index>(i);
    all.residuals.segment<2>(row) = views[i].px - image->px;
    all.jacobian.middleRows<2>(row) = image->d_px_d_point * camera.cam_from_world.rotation;
  }
  if (!all.jacobian.allFinite() || !all.residuals.allFinite()) return std::nullopt;
  return all;
}

}  // namespace

std::optional<Ray> ray_of(const Camera& camera, const Eigen::Vector2d& px) {
  const auto in_camera = unproject(camera.model, px);
  if (!in_camera) return std::nullopt;
  return Ray{centre_in_world(camera), camera.cam_from_world.rotation.transpose() * *in_camera};
}

std::optional<Vector3d> nearest_to_rays(const std::vector<Ray>& rays, double min_angle_rad) {
  if (rays.size() < 2) return std::nullopt;
  Matrix3d sum = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  double widest = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Vector3d& along = rays[i].direction;
    const Matrix3d across = Matrix3d::Identity() - along * along.transpose();
    sum += across;
    right += across * rays[i].origin_m;
    for (std::size_t j = 0; j < i; ++j)
      widest = std::max(
          widest, std::atan2(rays[j].direction.cross(along).norm(), rays[j].direction.dot(along)));
  }
  if (!(widest >= min_angle_rad)) return std::nullopt;
  return Vector3d(sum.ldlt().solve(right));
}

PointFit fit_point(const std::vector<PixelView>& views, double min_angle_rad,
                   const MatrixXd& shared_px) {
  PointFit fit;
  std::vector<Ray> rays;
  for (const PixelView& view : views) {
    const auto ray = ray_of(*view.camera, view.px);
    if (!ray) return fit;
    rays.push_back(*ray);
  }
  const auto start = nearest_to_rays(rays, min_angle_rad);
  if (!start || !start->allFinite()) return fit;
  fit.in_world = *start;
  fit.status = PointStatus::behind_a_camera;
  const auto rows = 2 * static_cast<Index>(views.size());
  fit.covariance_px2 = MatrixXd::Zero(rows, rows);
  for (std::size_t i = 0; i < views.size(); ++i)
    fit.covariance_px2.block<2, 2>(2 * static_cast<Index>(i), 2 * static_cast<Index>(i)) =
        views[i].covariance_px2;
  if (shared_px.size() > 0) fit.covariance_px2 += shared_px * shared_px.transpose();
  const MatrixXd lower = fit.covariance_px2.llt().matrixL();
  const auto whitened = [&](const auto& of_pixels) {
    return MatrixXd(lower.triangularView<Eigen::Lower>().solve(of_pixels));
  };
  auto at = linearise(views, fit.in_world);
  if (!at) return fit;
  fit.status = PointStatus::not_converged;
  for (int i = 0; i < kMaxSteps && fit.status != PointStatus::good; ++i) {
    const MatrixXd jacobian = whitened(at->jacobian);
    const Matrix3d normal = jacobian.transpose() * jacobian;
    const Vector3d step = normal.ldlt().solve(jacobian.transpose() * whitened(at->residuals));
    auto next = linearise(views, fit.in_world + step);
    if (!next) return fit;
    fit.in_world += step;
    at = std::move(next);
    // At the cameras' distance, the last digits of a double are about 1e-16 m.
    if (step.norm() <= kStepTolerance) fit.status = PointStatus::good;
  }
  if (fit.status != PointStatus::good) return fit;
  const MatrixXd jacobian = whitened(at->jacobian);
  const Matrix3d covariance = Matrix3d(jacobian.transpose() * jacobian).inverse();
  fit.by_pixels =
      covariance * lower.transpose().triangularView<Eigen::Upper>().solve(jacobian).transpose();
  fit.residuals_px = at->residuals;
  return fit;
}

}  // namespace drape
