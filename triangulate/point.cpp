// SPDX-License-Identifier: Apache-2.0
#include "triangulate/point.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/camera_derivatives.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kMaxSteps = 30;
constexpr double kStepTolerance = 1e-13;  // metres; a ten-millionth of a micrometre

/// Residuals and derivatives of all views at a point.
struct Linearised {
  MatrixXd jacobian;   ///< 2n x 3, px by metre
  VectorXd residuals;  ///< measured minus projected, px
};

std::optional<Linearised> linearise(const std::vector<View>& views, const Vector3d& in_world) {
  Linearised all;
  all.jacobian.resize(2 * views.size(), 3);
  all.residuals.resize(2 * views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Camera& camera = views[i].camera->camera;
    const auto image = project(camera.model, camera.cam_from_world * in_world);
    if (!image) return std::nullopt;
    const auto row = 2 * static_cast<Eigen::Index>(i);
    all.residuals.segment<2>(row) = views[i].px - image->px;
    all.jacobian.middleRows<2>(row) = image->d_px_d_point * camera.cam_from_world.rotation;
  }
  if (!all.jacobian.allFinite() || !all.residuals.allFinite()) return std::nullopt;
  return all;
}

/// What disturbs the pixels of a mark, besides the calibration.
struct Noise {
  MatrixXd detections;  ///< covariance, 2n x 2n, block diagonal by view
  MatrixXd shared;      ///< derivative by the shared unknowns, 2n x k
  MatrixXd lower;       ///< Cholesky factor of detections + shared shared'

  explicit Noise(const std::vector<View>& views)
      : detections(MatrixXd::Zero(2 * views.size(), 2 * views.size())),
        shared(2 * views.size(), views.front().shape_px.cols()) {
    for (std::size_t i = 0; i < views.size(); ++i) {
      const auto at = 2 * static_cast<Eigen::Index>(i);
      detections.block<2, 2>(at, at) = views[i].covariance_px2;
      shared.middleRows<2>(at) = views[i].shape_px;
    }
    lower = MatrixXd(detections + shared * shared.transpose()).llt().matrixL();
  }

  template <class M>
  [[nodiscard]] MatrixXd whitened(const M& rows) const {
    return lower.triangularView<Eigen::Lower>().solve(rows);
  }
};

/// Covariance of the projected pixels from cameras that were calibrated apart: block diagonal.
MatrixXd noise_of_separate_cameras(const std::vector<View>& views, const Vector3d& in_world) {
  MatrixXd pixels = MatrixXd::Zero(2 * views.size(), 2 * views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const CalibratedCamera& calibrated = *views[i].camera;
    if (calibrated.covariance.size() == 0) continue;
    const auto by_parameters = d_px_d_parameters(calibrated.camera, in_world);
    if (!by_parameters || by_parameters->cols() != calibrated.covariance.cols()) continue;
    const auto at = 2 * static_cast<Eigen::Index>(i);
    pixels.block<2, 2>(at, at) =
        *by_parameters * calibrated.covariance * by_parameters->transpose();
  }
  return pixels;
}

/// The same from cameras calibrated together, whose errors go hand in hand.
MatrixXd noise_of_joint_cameras(const std::vector<View>& views, const Vector3d& in_world) {
  const MatrixXd& covariance = *views.front().joint->covariance;
  MatrixXd by_all = MatrixXd::Zero(2 * views.size(), covariance.cols());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto by_parameters = d_px_d_parameters(views[i].camera->camera, in_world);
    if (!by_parameters) continue;
    for (Eigen::Index k = 0; k < by_parameters->cols(); ++k) {
      const Eigen::Index place = views[i].joint->places.at(k);
      if (place >= 0)
        by_all.block<2, 1>(2 * static_cast<Eigen::Index>(i), place) = by_parameters->col(k);
    }
  }
  return by_all * covariance * by_all.transpose();
}

void add_covariance(const std::vector<View>& views, const Noise& noise, const Linearised& at_end,
                    Point& point) {
  const MatrixXd whitened = noise.whitened(at_end.jacobian);
  const Matrix3d of_point = Matrix3d(whitened.transpose() * whitened).inverse();
  // How the point answers to its pixels: (J'WJ)^-1 J'W.
  const MatrixXd gain =
      of_point * noise.lower.transpose().triangularView<Eigen::Upper>().solve(whitened).transpose();
  const MatrixXd shared = gain * noise.shared;
  const MatrixXd calibration = views.front().joint != nullptr
                                   ? noise_of_joint_cameras(views, point.in_world)
                                   : noise_of_separate_cameras(views, point.in_world);
  point.detection_covariance_m2 = gain * noise.detections * gain.transpose();
  point.shape_covariance_m2 = shared * shared.transpose();
  point.calibration_covariance_m2 = gain * calibration * gain.transpose();
  const MatrixXd pixels = noise.lower * noise.lower.transpose() + calibration;
  point.chi2 = at_end.residuals.dot(pixels.llt().solve(at_end.residuals));
  point.degrees_of_freedom = 2 * static_cast<int>(views.size()) - 3;
  for (std::size_t i = 0; i < views.size(); ++i)
    point.residuals_px.emplace_back(at_end.residuals.segment<2>(2 * static_cast<Eigen::Index>(i)));
}

}  // namespace

Matrix3d Point::covariance_m2() const {
  return detection_covariance_m2 + shape_covariance_m2 + calibration_covariance_m2;
}

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
  const Noise noise(views);
  auto at = linearise(views, point.in_world);
  if (!at) return point;
  point.status = PointStatus::not_converged;
  for (int i = 0; i < kMaxSteps && point.status != PointStatus::good; ++i) {
    const MatrixXd jacobian = noise.whitened(at->jacobian);
    const VectorXd residuals = noise.whitened(at->residuals);
    const Matrix3d normal = jacobian.transpose() * jacobian;
    const Vector3d step = normal.ldlt().solve(jacobian.transpose() * residuals);
    auto next = linearise(views, point.in_world + step);
    if (!next) return point;
    point.in_world += step;
    at = std::move(next);
    // The last digits of a double at the cameras' distance are worth 1e-16 m.
    if (step.norm() <= kStepTolerance) point.status = PointStatus::good;
  }
  if (point.status == PointStatus::good) add_covariance(views, noise, *at, point);
  return point;
}

}  // namespace drape::triangulate
