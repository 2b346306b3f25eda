// SPDX-License-Identifier: Apache-2.0
#include "triangulate/point.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/camera_derivatives.hpp"

namespace drape {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kMaxSteps = 30;
constexpr double kStepTolerance = 1e-13;  // metres; a ten-millionth of a micrometre

/// Residuals and derivatives of all views at a point, whitened by the detections' covariances.
struct Linearised {
  MatrixXd jacobian;   ///< 2n x 3, px by metre, whitened
  VectorXd residuals;  ///< measured minus projected, whitened
  std::vector<Vector2d> residuals_px;
};

std::optional<Linearised> linearise(const std::vector<View>& views, const Vector3d& in_world) {
  Linearised all;
  all.jacobian.resize(2 * views.size(), 3);
  all.residuals.resize(2 * views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Camera& camera = views[i].camera->camera;
    const auto image = project(camera.model, camera.cam_from_world * in_world);
    if (!image) return std::nullopt;
    const Vector2d residual = views[i].px - image->px;
    const Matrix2d lower = views[i].covariance_px2.llt().matrixL();
    const auto solver = lower.triangularView<Eigen::Lower>();
    const auto row = 2 * static_cast<Eigen::Index>(i);
    all.residuals.segment<2>(row) = solver.solve(residual);
    all.jacobian.middleRows<2>(row) = solver.solve(
        Eigen::Matrix<double, 2, 3>(image->d_px_d_point * camera.cam_from_world.rotation));
    all.residuals_px.push_back(residual);
  }
  return all;
}

std::optional<Linearised> linearise_checked(const std::vector<View>& views,
                                            const Vector3d& in_world) {
  auto all = linearise(views, in_world);
  if (all && !(all->jacobian.allFinite() && all->residuals.allFinite())) return std::nullopt;
  return all;
}

struct Share {
  Matrix3d of_point;   ///< covariance of the point from the calibration alone
  MatrixXd of_pixels;  ///< and of the projected pixels, block diagonal by camera
};

/// J_cal Sigma J_cal' of each camera, carried to the point by the solution's own gain. Cameras
/// are calibrated apart, so their errors are independent.
Share calibration_share(const std::vector<View>& views, const Vector3d& in_world,
                        const Eigen::Matrix<double, 3, Eigen::Dynamic>& gain) {
  Share share{Matrix3d::Zero(), MatrixXd::Zero(2 * views.size(), 2 * views.size())};
  for (std::size_t i = 0; i < views.size(); ++i) {
    const CalibratedCamera& calibrated = *views[i].camera;
    if (calibrated.covariance.size() == 0) continue;
    const auto by_parameters = d_px_d_parameters(calibrated.camera, in_world);
    if (!by_parameters || by_parameters->cols() != calibrated.covariance.cols()) continue;
    const Matrix2d pixel = *by_parameters * calibrated.covariance * by_parameters->transpose();
    const auto at = 2 * static_cast<Eigen::Index>(i);
    share.of_pixels.block<2, 2>(at, at) = pixel;
    share.of_point += gain.middleCols<2>(at) * pixel * gain.middleCols<2>(at).transpose();
  }
  return share;
}

void add_covariance(const std::vector<View>& views, const Linearised& at_end, Point& point) {
  const Matrix3d normal = at_end.jacobian.transpose() * at_end.jacobian;
  point.detection_covariance_m2 = normal.inverse();
  Eigen::Matrix<double, 3, Eigen::Dynamic> gain =
      point.detection_covariance_m2 * at_end.jacobian.transpose();
  MatrixXd pixels = MatrixXd::Zero(2 * views.size(), 2 * views.size());
  VectorXd residual(2 * views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    const Matrix2d lower = views[i].covariance_px2.llt().matrixL();
    gain.middleCols<2>(at) = (gain.middleCols<2>(at) * lower.inverse()).eval();
    pixels.block<2, 2>(at, at) = views[i].covariance_px2;
    residual.segment<2>(at) = point.residuals_px[i];
  }
  const Share share = calibration_share(views, point.in_world, gain);
  point.calibration_covariance_m2 = share.of_point;
  point.chi2 = residual.dot((pixels + share.of_pixels).llt().solve(residual));
  point.degrees_of_freedom = 2 * static_cast<int>(views.size()) - 3;
}

}  // namespace

double Point::rms_px() const {
  double sum = 0;
  for (const Vector2d& residual : residuals_px) sum += residual.squaredNorm();
  return residuals_px.empty() ? 0 : std::sqrt(sum / static_cast<double>(residuals_px.size()));
}

double Point::disagreement_sigmas() const {
  if (degrees_of_freedom < 1) return 0;
  if (degrees_of_freedom == 1) return std::sqrt(chi2);
  // Wilson and Hilferty 1931: the cube root of chi-square is nearly normal.
  const double spread = 2.0 / (9.0 * degrees_of_freedom);
  return (std::cbrt(chi2 / degrees_of_freedom) - (1 - spread)) / std::sqrt(spread);
}

std::optional<Vector3d> midpoint(const std::vector<View>& views, double min_angle_rad) {
  std::vector<Vector3d> rays;
  Matrix3d sum = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const View& view : views) {
    const Camera& camera = view.camera->camera;
    const auto ray = unproject(camera.model, view.px);
    if (!ray) return std::nullopt;
    rays.emplace_back(camera.cam_from_world.rotation.transpose() * *ray);
    const Matrix3d across = Matrix3d::Identity() - rays.back() * rays.back().transpose();
    sum += across;
    right += across * centre_in_world(camera);
  }
  double widest = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    for (std::size_t j = i + 1; j < rays.size(); ++j)
      widest = std::max(widest, std::atan2(rays[i].cross(rays[j]).norm(), rays[i].dot(rays[j])));
  }
  if (!(widest >= min_angle_rad)) return std::nullopt;
  return Vector3d(sum.ldlt().solve(right));
}

Point solve_point(const std::vector<View>& views, double min_angle_rad) {
  Point point;
  if (views.size() < 2) return point;
  const auto start = midpoint(views, min_angle_rad);
  if (!start || !start->allFinite()) return point;
  point.in_world = *start;
  point.status = PointStatus::behind_a_camera;
  auto at = linearise_checked(views, point.in_world);
  if (!at) return point;
  point.status = PointStatus::not_converged;
  for (int i = 0; i < kMaxSteps && point.status != PointStatus::good; ++i) {
    const Matrix3d normal = at->jacobian.transpose() * at->jacobian;
    const Vector3d step = normal.ldlt().solve(at->jacobian.transpose() * at->residuals);
    auto next = linearise_checked(views, point.in_world + step);
    if (!next) return point;
    point.in_world += step;
    at = std::move(next);
    // The last digits of a double at the cameras' distance are worth 1e-16 m.
    if (step.norm() <= kStepTolerance) point.status = PointStatus::good;
  }
  point.residuals_px = at->residuals_px;
  if (point.status == PointStatus::good) add_covariance(views, *at, point);
  return point;
}

}  // namespace drape
