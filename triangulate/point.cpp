// SPDX-License-Identifier: Apache-2.0
#include "triangulate/point.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/camera_derivatives.hpp"
#include "core/geometry/dense.hpp"

namespace drape::triangulate {

using Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d, Eigen::VectorXd;

namespace {

/// Covariance of the projected pixels for separately calibrated cameras: block diagonal.
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

/// Derivative of all pixels by the parameters of jointly calibrated cameras, whose errors are
/// correlated.
MatrixXd by_joint_cameras(const std::vector<View>& views, const Vector3d& in_world) {
  MatrixXd by_all = MatrixXd::Zero(2 * views.size(), views.front().joint->covariance->cols());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto by_parameters = d_px_d_parameters(views[i].camera->camera, in_world);
    if (!by_parameters) continue;
    for (Eigen::Index k = 0; k < by_parameters->cols(); ++k) {
      const Eigen::Index place = views[i].joint->places.at(k);
      if (place >= 0)
        by_all.block<2, 1>(2 * static_cast<Eigen::Index>(i), place) = by_parameters->col(k);
    }
  }
  return by_all;
}

std::string why_not(PointStatus status) {
  switch (status) {
    case PointStatus::not_observable:
      return "not observable: the rays of its views are nearly parallel";
    case PointStatus::behind_a_camera:
      return "views disagree: the rays meet behind a camera or outside its lens model";
    default:
      return "not converged";
  }
}

std::string names_of(const std::vector<View>& views) {
  std::string names;
  for (const View& view : views) names += (names.empty() ? "" : ", ") + view.camera->camera.name;
  return names;
}

std::vector<View> without(const std::vector<View>& views, std::size_t index) {
  std::vector<View> rest = views;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(index));
  return rest;
}

/// Best of the solutions with one view left out.
struct LeftOut {
  Point point;
  std::size_t index = 0;
  bool unique = true;  ///< true if no other single omission makes the views agree
};

std::optional<LeftOut> leave_one_out(const std::vector<View>& views,
                                     const AgreementLimits& limits) {
  std::optional<LeftOut> best;
  int agreeing = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    Point point = solve_point(without(views, i), limits.min_angle_rad);
    if (point.status != PointStatus::good) continue;
    agreeing += point.disagreement_sigmas() <= limits.max_sigmas;
    if (!best || point.disagreement_sigmas() < best->point.disagreement_sigmas())
      best = LeftOut{std::move(point), i, true};
  }
  if (!best || best->point.disagreement_sigmas() > limits.max_sigmas) return std::nullopt;
  best->unique = agreeing == 1;
  return best;
}

/// Widens the covariance to the views' scatter (Birge 1932), as an error of the dot's shape.
void widen(Point& point) {
  const double surplus = std::max(0.0, point.chi2 / point.degrees_of_freedom - 1);
  point.shape_covariance_m2 +=
      surplus * (point.detection_covariance_m2 + point.shape_covariance_m2);
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
  // Wilson and Hilferty 1931: the cube root of a chi-square variable is nearly normal.
  const double spread = 2.0 / (9.0 * degrees_of_freedom);
  return (std::cbrt(chi2 / degrees_of_freedom) - (1 - spread)) / std::sqrt(spread);
}

std::optional<Vector3d> midpoint(const std::vector<View>& views, double min_angle_rad) {
  std::vector<Ray> rays;
  for (const View& view : views) {
    const auto ray = ray_of(view.camera->camera, view.px);
    if (!ray) return std::nullopt;
    rays.push_back(*ray);
  }
  return nearest_to_rays(rays, min_angle_rad);
}

Point solve_point(const std::vector<View>& views, double min_angle_rad) {
  Point point;
  if (views.size() < 2) return point;
  std::vector<PixelView> pixels;
  MatrixXd shared(2 * views.size(), views.front().shape_px.cols());
  for (const View& view : views) {
    shared.middleRows<2>(2 * static_cast<Eigen::Index>(pixels.size())) = view.shape_px;
    pixels.push_back({&view.camera->camera, view.px, view.covariance_px2});
  }
  const PointFit fit = fit_point(pixels, min_angle_rad, shared);
  point.status = fit.status;
  point.in_world = fit.in_world;
  if (fit.status != PointStatus::good) return point;
  const MatrixXd by_shared = fit.by_pixels * shared;
  MatrixXd calibration;
  if (const InJointCovariance* joint = views.front().joint) {
    const MatrixXd by_cameras = by_joint_cameras(views, point.in_world);
    calibration = by_cameras * *joint->covariance * by_cameras.transpose();
    const MatrixXd moves = fit.by_pixels * by_cameras;
    if (joint->target != nullptr)
      point.target_covariance_m2 = moves * *joint->target * moves.transpose();
  } else {
    calibration = noise_of_separate_cameras(views, point.in_world);
  }
  point.shape_covariance_m2 = by_shared * by_shared.transpose();
  point.calibration_covariance_m2 = fit.by_pixels * calibration * fit.by_pixels.transpose();
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    const auto by_view = fit.by_pixels.middleCols<2>(at);
    point.detection_covariance_m2 += by_view * views[i].covariance_px2 * by_view.transpose();
    point.residuals_px.emplace_back(fit.residuals_px.segment<2>(at));
  }
  point.chi2 = fit.residuals_px.dot(
      solve_positive(fit.covariance_px2 + calibration, VectorXd(fit.residuals_px)));
  point.degrees_of_freedom = 2 * static_cast<int>(views.size()) - 3;
  return point;
}

Agreed solve_with_agreement(const std::vector<View>& views, const AgreementLimits& limits) {
  Agreed result;
  Point all = solve_point(views, limits.min_angle_rad);
  result.disagreement_sigmas = all.disagreement_sigmas();
  const bool within = result.disagreement_sigmas <= limits.max_sigmas;
  const bool bent = !within && views.size() >= 3 && all.rms_px() <= limits.shape_px;
  if (all.status == PointStatus::good && (within || bent)) {
    if (bent) widen(all);
    result.point = std::move(all);
    result.used.resize(views.size());
    std::iota(result.used.begin(), result.used.end(), std::size_t{0});
    return result;
  }
  if (views.size() >= 3) {
    if (auto rest = leave_one_out(views, limits); rest && rest->unique) {
      result.point = std::move(rest->point);
      result.dropped = rest->index;
      for (std::size_t i = 0; i < views.size(); ++i)
        if (i != rest->index) result.used.push_back(i);
      return result;
    }
  }
  result.gap_reason =
      all.status == PointStatus::good
          ? fmt::format(
                "views disagree: {} miss each other by {:.1f} sigma ({:.2f} px), limit {:g}",
                names_of(views), result.disagreement_sigmas, all.rms_px(), limits.max_sigmas)
          : why_not(all.status);
  return result;
}

}  // namespace drape::triangulate
