// SPDX-License-Identifier: Apache-2.0
#include "calib/tsai/residuals.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/units.hpp"

namespace drape::calib {
namespace {

using units::mm;

/// Focal lengths of an ideal camera in pixels per unit of x/z and y/z.
Eigen::Vector2d focal_px(const CameraModel& model) {
  if (const auto* brown = std::get_if<BrownLens>(&model.lens)) return {brown->fx_px, brown->fy_px};
  const auto& tsai = std::get<TsaiLens>(model.lens);
  return {tsai.focal_m * tsai.scale_x / tsai.pixel_pitch_x_m, tsai.focal_m / tsai.pixel_pitch_y_m};
}

void add(ErrorMeasure& measure, double error) {
  measure.mean += error;
  measure.max = std::max(measure.max, error);
}

}  // namespace

ClassicalErrors classical_errors(const Camera& camera, const std::vector<Correspondence>& points) {
  ClassicalErrors errors;
  const Eigen::Vector2d focal = focal_px(camera.model);
  int count = 0;
  for (const Correspondence& point : points) {
    const double distorted = distance_px(camera, point);
    const auto ray = unproject(camera.model, point.px);
    if (!std::isfinite(distorted) || !ray) continue;
    const Eigen::Vector3d in_camera = camera.cam_from_world * point.point_in_world;
    const Eigen::Vector2d off = ray->hnormalized() - in_camera.hnormalized();
    add(errors.distorted_px, distorted);
    add(errors.undistorted_px, focal.cwiseProduct(off).norm());
    add(errors.object_mm, *miss_m(camera, point) / mm);
    ++count;
  }
  for (ErrorMeasure* measure : {&errors.distorted_px, &errors.undistorted_px, &errors.object_mm})
    measure->mean /= std::max(count, 1);
  errors.normalised = normalised_error(camera, points);
  return errors;
}

std::optional<double> miss_m(const Camera& camera, const Correspondence& point) {
  const auto ray = unproject(camera.model, point.px);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d in_camera = camera.cam_from_world * point.point_in_world;
  return (in_camera - in_camera.dot(*ray) * *ray).norm();
}

double distance_px(const Camera& camera, const Correspondence& point) {
  const auto image = project(camera.model, camera.cam_from_world * point.point_in_world);
  return image ? (image->px - point.px).norm() : std::numeric_limits<double>::infinity();
}

CalibrationResiduals residuals_of(const Camera& camera, const std::vector<Correspondence>& points) {
  CalibrationResiduals result;
  double sum_px2 = 0, sum_mm2 = 0;
  for (const Correspondence& point : points) {
    const double px = distance_px(camera, point);
    const auto miss = miss_m(camera, point);
    if (!std::isfinite(px) || !miss) continue;
    ++result.points;
    sum_px2 += px * px;
    sum_mm2 += *miss * *miss / (mm * mm);
    result.max_px = std::max(result.max_px, px);
  }
  if (result.points > 0) {
    result.rms_px = std::sqrt(sum_px2 / result.points);
    result.object_rms_mm = std::sqrt(sum_mm2 / result.points);
  }
  return result;
}

double normalised_error(const Camera& camera, const std::vector<Correspondence>& points) {
  // Rounding to whole pixels in x and y has a variance of (pitch^2)/12 in each.
  const Eigen::Vector2d pitch = focal_px(camera.model).cwiseInverse();
  const double rounding = std::sqrt(pitch.squaredNorm() / 12);
  double sum = 0;
  for (const Correspondence& point : points) {
    const Eigen::Vector3d in_camera = camera.cam_from_world * point.point_in_world;
    const auto ray = unproject(camera.model, point.px);
    if (!ray) return std::numeric_limits<double>::infinity();
    const Eigen::Vector3d at_depth = *ray * (in_camera.z() / ray->z());
    sum += (at_depth - in_camera).norm() / (in_camera.z() * rounding);
  }
  return points.empty() ? 0 : sum / static_cast<double>(points.size());
}

Eigen::Vector4d covered_region_px(const std::vector<Correspondence>& points) {
  constexpr double kFar = std::numeric_limits<double>::max();
  Eigen::Vector4d region(kFar, kFar, -kFar, -kFar);
  for (const Correspondence& point : points) {
    region.head<2>() = region.head<2>().cwiseMin(point.px);
    region.tail<2>() = region.tail<2>().cwiseMax(point.px);
  }
  return region;
}

}  // namespace drape::calib
