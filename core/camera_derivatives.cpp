// SPDX-License-Identifier: Apache-2.0
#include "core/camera_derivatives.hpp"

#include <cmath>

#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

Matrix2X lens_columns(const BrownLens& lens, const Vector3d& point, const Projection& image) {
  const double x = point.x() / point.z(), y = point.y() / point.z();
  const double r2 = x * x + y * y;
  Matrix2X d(2, 9);
  d << (image.px.x() - lens.cx_px) / lens.fx_px, 0, 1, 0, x * r2, x * r2 * r2, 2 * x * y,
      r2 + 2 * x * x, x * r2 * r2 * r2,  //
      0, (image.px.y() - lens.cy_px) / lens.fy_px, 0, 1, y * r2, y * r2 * r2, r2 + 2 * y * y,
      2 * x * y, y * r2 * r2 * r2;
  const auto distortion = d.rightCols<5>();
  const Vector2d focal(lens.fx_px, lens.fy_px);
  d.rightCols<5>() = (focal.asDiagonal() * distortion).eval();
  return d;
}

Matrix2X lens_columns(const TsaiLens& lens, const Vector3d& point, const Projection& image) {
  const Vector2d px_per_m(lens.scale_x / lens.pixel_pitch_x_m, 1 / lens.pixel_pitch_y_m);
  const Vector2d from_centre = image.px - Vector2d(lens.cx_px, lens.cy_px);
  const double r2 = from_centre.cwiseQuotient(px_per_m).squaredNorm();
  // d r_d / d kappa1 = -r_d^3 / (1 + 3 kappa1 r_d^2), from r_d (1 + kappa1 r_d^2) = r_u.
  const Vector2d by_kappa = -r2 / (1 + 3 * lens.kappa1_per_m2 * r2) * from_centre;
  const Vector2d by_focal = image.d_px_d_point.leftCols<2>() * point.head<2>() / lens.focal_m;
  Matrix2X d(2, 5);
  d.col(0) = by_focal * mm;
  d.col(1) = by_kappa / (mm * mm);
  d.rightCols<3>() << 1, 0, from_centre.x() / lens.scale_x, 0, 1, 0;
  return d;
}

}  // namespace

std::optional<Matrix2X> d_px_d_lens(const CameraModel& model, const Vector3d& point_in_camera) {
  const std::optional<Projection> image = project(model, point_in_camera);
  if (!image) return std::nullopt;
  return std::visit([&](const auto& lens) { return lens_columns(lens, point_in_camera, *image); },
                    model.lens);
}

Eigen::Matrix3d left_jacobian(const Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  const Eigen::Matrix3d k = cross_matrix(rotation_vector);
  // Below 1e-4 rad the closed forms cancel, and the next terms of the series are below 1e-9.
  const double first = angle < 1e-4 ? 0.5 : (1 - std::cos(angle)) / (angle * angle);
  const double second =
      angle < 1e-4 ? 1.0 / 6.0 : (angle - std::sin(angle)) / (angle * angle * angle);
  return Eigen::Matrix3d::Identity() + first * k + second * k * k;
}

std::optional<Matrix2X> d_px_d_parameters(const Camera& camera, const Vector3d& point_in_world) {
  const Vector3d rotated = camera.cam_from_world.rotation * point_in_world;
  const Vector3d point = rotated + camera.cam_from_world.translation_m;
  const std::optional<Matrix2X> lens = d_px_d_lens(camera.model, point);
  if (!lens) return std::nullopt;
  const auto by_point = project(camera.model, point)->d_px_d_point;
  Matrix2X all(2, lens->cols() + 6);
  all << *lens,
      -by_point * cross_matrix(rotated) *
          left_jacobian(rotation_vector(camera.cam_from_world.rotation)),
      by_point * mm;
  return all;
}

}  // namespace drape
