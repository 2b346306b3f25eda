// SPDX-License-Identifier: Apache-2.0
#include "core/camera_model.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kNewtonSteps = 50;

struct Distorted {
  Vector2d point;
  Matrix2d jacobian;  ///< derivative of the distorted point with respect to the undistorted one
};

/// d/dr of the radial displacement r (1 + k1 r^2 + k2 r^4 + k3 r^6); where it is not positive the
/// image folds over and a pixel has no unique ray.
double radial_slope(const BrownLens& lens, double r2) {
  return 1 + r2 * (3 * lens.k1 + r2 * (5 * lens.k2 + r2 * 7 * lens.k3));
}

/// True if the slope is positive along the whole radius, not only at its end.
bool is_monotonic(const BrownLens& lens, double r2) {
  constexpr int kSamples = 8;
  for (int i = 1; i <= kSamples; ++i)
    if (radial_slope(lens, r2 * i / kSamples) <= 0) return false;
  return true;
}

Distorted brown_distort(const BrownLens& lens, const Vector2d& p) {
  const double x = p.x(), y = p.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  const double d_radial = lens.k1 + r2 * (2 * lens.k2 + r2 * 3 * lens.k3);  // derivative by r2
  Distorted out;
  out.point = {x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x),
               y * radial + lens.p1 * (r2 + 2 * y * y) + 2 * lens.p2 * x * y};
  out.jacobian << radial + 2 * x * x * d_radial + 2 * lens.p1 * y + 6 * lens.p2 * x,
      2 * x * y * d_radial + 2 * lens.p1 * x + 2 * lens.p2 * y,
      2 * x * y * d_radial + 2 * lens.p1 * x + 2 * lens.p2 * y,
      radial + 2 * y * y * d_radial + 6 * lens.p1 * y + 2 * lens.p2 * x;
  return out;
}

/// Distorted sensor radius r of the undistorted radius ru: root of kappa r^3 + r - ru on the branch
/// through 0. nullopt where kappa1 < 0 and ru exceeds the cubic's maximum (Tsai 1987).
std::optional<double> tsai_distorted_radius(double kappa, double ru) {
  if (kappa < 0) {
    const double r_limit = std::sqrt(-1 / (3 * kappa));
    if (ru >= 2.0 / 3.0 * r_limit) return std::nullopt;
  }
  double r = ru;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const double value = kappa * r * r * r + r - ru;
    const double slope = 3 * kappa * r * r + 1;
    const double step = value / slope;
    r -= step;
    if (std::abs(step) <= 1e-16 * (1 + std::abs(r))) break;
  }
  return r;
}

std::optional<Projection> project_with(const BrownLens& lens, const Vector3d& point) {
  const Vector2d p(point.x() / point.z(), point.y() / point.z());
  if (!is_monotonic(lens, p.squaredNorm())) return std::nullopt;
  const Distorted d = brown_distort(lens, p);
  Eigen::Matrix<double, 2, 3> d_p;
  d_p << 1 / point.z(), 0, -p.x() / point.z(), 0, 1 / point.z(), -p.y() / point.z();
  const Vector2d focal(lens.fx_px, lens.fy_px);
  return Projection{focal.cwiseProduct(d.point) + Vector2d(lens.cx_px, lens.cy_px),
                    focal.asDiagonal() * d.jacobian * d_p};
}

std::optional<Projection> project_with(const TsaiLens& lens, const Vector3d& point) {
  const Vector2d undistorted = lens.focal_m / point.z() * point.head<2>();
  const double ru = undistorted.norm();
  const std::optional<double> rd = tsai_distorted_radius(lens.kappa1_per_m2, ru);
  if (!rd) return std::nullopt;
  const double ratio = ru > 0 ? *rd / ru : 1.0;
  const double d_rd = 1 / (1 + 3 * lens.kappa1_per_m2 * *rd * *rd);  // derivative by ru
  Matrix2d jacobian = ratio * Matrix2d::Identity();
  if (ru > 0) jacobian += (d_rd - ratio) * undistorted * undistorted.transpose() / (ru * ru);
  const Vector2d px_per_m(lens.scale_x / lens.pixel_pitch_x_m, 1 / lens.pixel_pitch_y_m);
  Eigen::Matrix<double, 2, 3> d_u;
  d_u << lens.focal_m / point.z(), 0, -undistorted.x() / point.z(), 0, lens.focal_m / point.z(),
      -undistorted.y() / point.z();
  return Projection{px_per_m.cwiseProduct(ratio * undistorted) + Vector2d(lens.cx_px, lens.cy_px),
                    px_per_m.asDiagonal() * jacobian * d_u};
}

std::optional<Vector3d> unproject_with(const BrownLens& lens, const Vector2d& px) {
  const Vector2d target((px.x() - lens.cx_px) / lens.fx_px, (px.y() - lens.cy_px) / lens.fy_px);
  Vector2d p = target;
  bool converged = false;
  for (int i = 0; i < kNewtonSteps && !converged; ++i) {
    const Distorted d = brown_distort(lens, p);
    const Vector2d step = d.jacobian.inverse() * (d.point - target);
    if (!step.allFinite()) return std::nullopt;
    p -= step;
    converged = step.norm() <= 1e-15 * (1 + p.norm());
  }
  const bool hits = (brown_distort(lens, p).point - target).norm() <= 1e-12;
  if (!hits || !is_monotonic(lens, p.squaredNorm())) return std::nullopt;
  return Vector3d(p.x(), p.y(), 1).normalized();
}

std::optional<Vector3d> unproject_with(const TsaiLens& lens, const Vector2d& px) {
  const Vector2d distorted((px.x() - lens.cx_px) * lens.pixel_pitch_x_m / lens.scale_x,
                           (px.y() - lens.cy_px) * lens.pixel_pitch_y_m);
  const double r2 = distorted.squaredNorm();
  if (1 + 3 * lens.kappa1_per_m2 * r2 <= 0) return std::nullopt;
  const Vector2d undistorted = (1 + lens.kappa1_per_m2 * r2) * distorted;
  return Vector3d(undistorted.x(), undistorted.y(), lens.focal_m).normalized();
}

}  // namespace

std::optional<Projection> project(const CameraModel& model, const Vector3d& point_in_camera) {
  if (!point_in_camera.allFinite() || point_in_camera.z() <= 0) return std::nullopt;
  return std::visit([&](const auto& lens) { return project_with(lens, point_in_camera); },
                    model.lens);
}

std::optional<Vector3d> unproject(const CameraModel& model, const Vector2d& px) {
  if (!px.allFinite()) return std::nullopt;
  return std::visit([&](const auto& lens) { return unproject_with(lens, px); }, model.lens);
}

Vector3d centre_in_world(const Camera& camera) {
  return camera.cam_from_world.inverse().translation_m;
}

namespace {

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

std::optional<Eigen::Vector2d> dot_centroid_px(const CameraModel& model, const DotInCamera& dot) {
  using Eigen::Vector2d;
  using Eigen::Vector3d;
  // The outline is smooth and periodic, so the trapezoidal rule converges exponentially.
  constexpr int kNodes = 16;
  const std::optional<Projection> centre = project(model, dot.centre);
  if (!centre) return std::nullopt;
  const Vector3d normal = dot.axis_u.cross(dot.axis_v);
  const double r = dot.radius_m;
  double area2 = 0;                    // twice the area, px^2
  Vector2d moment = Vector2d::Zero();  // first moment of the area about the image of the centre
  for (int i = 0; i < kNodes; ++i) {
    const double angle = 2 * std::numbers::pi * i / kNodes;
    const Vector2d e(std::cos(angle), std::sin(angle));
    const Vector2d e_slope(-e.y(), e.x());
    const Vector2d bent = dot.curvature_per_m * e;
    const Vector3d point = dot.centre + r * (e.x() * dot.axis_u + e.y() * dot.axis_v) -
                           0.5 * r * r * e.dot(bent) * normal;
    const Vector3d tangent = r * (e_slope.x() * dot.axis_u + e_slope.y() * dot.axis_v) -
                             r * r * e_slope.dot(bent) * normal;
    const std::optional<Projection> image = project(model, point);
    if (!image) return std::nullopt;
    const Vector2d p = image->px - centre->px;
    const Vector2d d = image->d_px_d_point * tangent;
    area2 += p.x() * d.y() - p.y() * d.x();
    moment += Vector2d(p.x() * p.x() * d.y(), -p.y() * p.y() * d.x());
  }
  const Vector2d offset = moment / area2;
  if (!offset.allFinite()) return std::nullopt;
  return centre->px + offset;
}

std::optional<Eigen::Vector2d> eccentricity_px(const CameraModel& model, const DotInCamera& dot) {
  const auto centroid = dot_centroid_px(model, dot);
  const auto centre = project(model, dot.centre);
  if (!centroid || !centre) return std::nullopt;
  return Eigen::Vector2d(*centroid - centre->px);
}

}  // namespace drape
