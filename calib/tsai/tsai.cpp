// SPDX-License-Identifier: Apache-2.0
#include "calib/tsai/tsai.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

namespace drape::calib {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kRankTolerance = 1e-9;

/// Position on the sensor from the image centre (metres), with s_x = 1.
Vector2d on_sensor(const Correspondence& p, const TsaiSensor& sensor) {
  return {(p.px.x() - sensor.cx_px) * sensor.pixel_pitch_x_m,
          (p.px.y() - sensor.cy_px) * sensor.pixel_pitch_y_m};
}

/// Least squares with columns scaled to unit length; nullopt if rank-deficient.
std::optional<VectorXd> solve(MatrixXd a, const VectorXd& b) {
  const VectorXd scale = a.colwise().norm();
  if (!a.allFinite() || scale.minCoeff() <= 0) return std::nullopt;
  a = (a * scale.cwiseInverse().asDiagonal()).eval();
  Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
  qr.setThreshold(kRankTolerance);
  if (qr.rank() < a.cols()) return std::nullopt;
  return VectorXd(qr.solve(b).cwiseQuotient(scale));
}

/// Rotation with the roll, pitch and yaw of the two estimated rows, which noise makes slightly
/// non-orthogonal; as in Willson's program.
Eigen::Matrix3d rotation_of_rows(const Vector3d& row1, const Vector3d& row2) {
  const Vector3d row3 = row1.cross(row2);
  const double yaw = std::atan2(row2.x(), row1.x());
  const double s = std::sin(yaw), c = std::cos(yaw);
  const double pitch = std::atan2(-row3.x(), row1.x() * c + row2.x() * s);
  const double roll = std::atan2(row1.z() * s - row2.z() * c, row2.y() * c - row1.y() * s);
  using Eigen::AngleAxisd;
  return (AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(pitch, Vector3d::UnitY()) *
          AngleAxisd(roll, Vector3d::UnitX()))
      .toRotationMatrix();
}

const Correspondence& farthest_from_centre(const std::vector<Correspondence>& points,
                                           const TsaiSensor& sensor) {
  const Correspondence* farthest = &points.front();
  for (const Correspondence& p : points) {
    if (on_sensor(p, sensor).squaredNorm() > on_sensor(*farthest, sensor).squaredNorm())
      farthest = &p;
  }
  return *farthest;
}

/// Sign of Ty: positive if the farthest point and its image have equal signs in the camera frame.
double sign_of_ty(const Vector2d& xy_in_camera_for_positive_ty, const Vector2d& sensor_xy) {
  return xy_in_camera_for_positive_ty.cwiseProduct(sensor_xy).sum() >= 0 ? 1.0 : -1.0;
}

/// Fills in a row of the radial alignment constraint for the 7 (or 5) unknowns over Ty.
void fill_row(MatrixXd& a, VectorXd& b, Eigen::Index i, const Correspondence& p, const Vector2d& s,
              Eigen::Index dimensions) {
  const auto world = p.point_in_world.head(dimensions).transpose();
  a.row(i).head(dimensions) = s.y() * world;
  a(i, dimensions) = s.y();
  a.row(i).tail(dimensions) = -s.x() * world;
  b[i] = s.x();
}

std::optional<VectorXd> solve_over_ty(const std::vector<Correspondence>& points,
                                      const TsaiSensor& sensor, Eigen::Index dimensions) {
  const auto n = static_cast<Eigen::Index>(points.size());
  if (n < 2 * dimensions + 1) return std::nullopt;
  MatrixXd a(n, 2 * dimensions + 1);
  VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i)
    fill_row(a, b, i, points[i], on_sensor(points[i], sensor), dimensions);
  return solve(a, b);
}

std::optional<RadialAlignment> align_about_origin(const std::vector<Correspondence>& points,
                                                  const TsaiSensor& sensor) {
  const std::optional<VectorXd> over_ty = solve_over_ty(points, sensor, 3);
  if (!over_ty) return std::nullopt;
  const Vector3d row1 = over_ty->head<3>(), row2 = over_ty->tail<3>();
  double ty = 1 / row2.norm();
  const double scale_x = ty * row1.norm();
  const Correspondence& far = farthest_from_centre(points, sensor);
  const Vector2d xy((row1.dot(far.point_in_world) + (*over_ty)[3]) * ty,
                    (row2.dot(far.point_in_world) + 1) * ty);
  ty *= sign_of_ty(xy, on_sensor(far, sensor));
  RadialAlignment result;
  result.rotation = rotation_of_rows(row1 * ty / scale_x, row2 * ty);
  result.tx_m = (*over_ty)[3] * ty / scale_x;
  result.ty_m = ty;
  result.scale_x = scale_x;
  if (!result.rotation.allFinite() || !(scale_x > 0)) return std::nullopt;
  return result;
}

/// Homogeneous form of the constraint, without division by Ty. It is regular at Ty = 0 but weights
/// noise differently, so only the second row and Ty are taken from it.
struct SecondRow {
  Vector3d row;
  double ty_m = 0;
};

/// `dimensions` of the world: 3, or 2 for a plane, whose second row then lacks its third element.
std::optional<SecondRow> homogeneous_second_row(const std::vector<Correspondence>& points,
                                                const TsaiSensor& sensor, Eigen::Index dimensions) {
  const auto n = static_cast<Eigen::Index>(points.size());
  const Eigen::Index half = dimensions + 1;
  MatrixXd a(n, 2 * half);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector2d s = on_sensor(points[i], sensor);
    const auto world = points[i].point_in_world.head(dimensions).transpose();
    a.row(i) << s.y() * world, s.y(), -s.x() * world, -s.x();
  }
  const VectorXd scale = a.colwise().norm();
  if (!a.allFinite() || scale.minCoeff() <= 0) return std::nullopt;
  a = (a * scale.cwiseInverse().asDiagonal()).eval();
  const Eigen::JacobiSVD<MatrixXd> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const VectorXd solution = svd.matrixV().col(2 * half - 1).cwiseQuotient(scale);
  const double length = solution.segment(half, dimensions).norm();
  if (!(length > 0)) return std::nullopt;
  SecondRow second{Vector3d::Zero(), solution[2 * half - 1] / length};
  second.row.head(dimensions) = solution.segment(half, dimensions) / length;
  return second;
}

/// RMS distance of the points from their mean.
double extent(const std::vector<Correspondence>& points) {
  Vector3d mean = Vector3d::Zero();
  for (const Correspondence& p : points) mean += p.point_in_world;
  mean /= static_cast<double>(points.size());
  double sum = 0;
  for (const Correspondence& p : points) sum += (p.point_in_world - mean).squaredNorm();
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/// Ty^2 for one plane, from the four known rotation terms over Ty (Tsai 1987, eq. 17).
double ty_squared_coplanar(const Vector2d& row1, const Vector2d& row2) {
  const double sum = row1.squaredNorm() + row2.squaredNorm();
  const double det = row1.x() * row2.y() - row1.y() * row2.x();
  if (std::abs(det) < 1e-12 * sum) return 1 / std::max(row1.squaredNorm(), row2.squaredNorm());
  return 2 / (sum + std::sqrt(std::max(0.0, sum * sum - 4 * det * det)));
}

std::optional<RadialAlignment> align_plane_about_origin(const std::vector<Correspondence>& points,
                                                        const TsaiSensor& sensor) {
  const std::optional<VectorXd> over_ty = solve_over_ty(points, sensor, 2);
  if (!over_ty) return std::nullopt;
  const Vector2d row1 = over_ty->head<2>(), row2 = over_ty->tail<2>();
  double ty = std::sqrt(ty_squared_coplanar(row1, row2));
  const Correspondence& far = farthest_from_centre(points, sensor);
  const Vector2d plane_point = far.point_in_world.head<2>();
  const Vector2d xy((row1.dot(plane_point) + (*over_ty)[2]) * ty, (row2.dot(plane_point) + 1) * ty);
  ty *= sign_of_ty(xy, on_sensor(far, sensor));
  const auto third = [](const Vector2d& v) {
    return std::sqrt(std::max(0.0, 1 - v.squaredNorm()));
  };
  const Vector2d r1 = row1 * ty, r2 = row2 * ty;
  const double opposite = r1.dot(r2) > 0 ? -1.0 : 1.0;
  RadialAlignment result;
  result.rotation =
      rotation_of_rows({r1.x(), r1.y(), third(r1)}, {r2.x(), r2.y(), opposite * third(r2)});
  result.tx_m = (*over_ty)[2] * ty;
  result.ty_m = ty;
  if (!result.rotation.allFinite()) return std::nullopt;
  return result;
}

using Alignment = std::optional<RadialAlignment>(const std::vector<Correspondence>&,
                                                 const TsaiSensor&);

/// Stage 1 for Ty near 0, by which every unknown is divided: shifts the origin along the camera's
/// y, solves, and shifts it back.
std::optional<RadialAlignment> align_off_the_axis(const std::vector<Correspondence>& points,
                                                  const TsaiSensor& sensor, Eigen::Index dimensions,
                                                  Alignment& align) {
  const std::optional<SecondRow> second = homogeneous_second_row(points, sensor, dimensions);
  if (!second) return std::nullopt;
  const double size = extent(points);
  if (std::abs(second->ty_m) > 0.1 * size) return align(points, sensor);
  const Vector3d origin = size * second->row;
  std::vector<Correspondence> shifted = points;
  for (Correspondence& p : shifted) p.point_in_world -= origin;
  std::optional<RadialAlignment> result = align(shifted, sensor);
  if (!result) return std::nullopt;
  const Vector3d back = result->rotation * origin;
  result->tx_m -= back.x();
  result->ty_m -= back.y();
  result->origin_shifted = true;
  return result;
}

}  // namespace

std::optional<RadialAlignment> align_non_coplanar(const std::vector<Correspondence>& points,
                                                  const TsaiSensor& sensor) {
  if (points.size() < 7) return std::nullopt;
  return align_off_the_axis(points, sensor, 3, align_about_origin);
}

std::optional<RadialAlignment> align_coplanar(const std::vector<Correspondence>& points,
                                              const TsaiSensor& sensor) {
  if (points.size() < 5) return std::nullopt;
  return align_off_the_axis(points, sensor, 2, align_plane_about_origin);
}

RadialAlignment mirrored(const RadialAlignment& alignment) {
  RadialAlignment result = alignment;
  const Eigen::Vector3d plane(1, 1, -1);
  result.rotation = plane.asDiagonal() * alignment.rotation * plane.asDiagonal();
  return result;
}

std::optional<FocalAndDepth> solve_focal_and_depth(const std::vector<Correspondence>& points,
                                                   const TsaiSensor& sensor,
                                                   const RadialAlignment& alignment) {
  const auto n = static_cast<Eigen::Index>(points.size());
  MatrixXd a(n, 2);
  VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector3d rotated = alignment.rotation * points[i].point_in_world;
    const double y = on_sensor(points[i], sensor).y();
    a.row(i) << rotated.y() + alignment.ty_m, -y;
    b[i] = rotated.z() * y;
  }
  const std::optional<VectorXd> solution = solve(a, b);
  if (!solution || !solution->allFinite()) return std::nullopt;
  return FocalAndDepth{(*solution)[0], (*solution)[1]};
}

Camera start_camera(const TsaiSensor& sensor, const RadialAlignment& alignment,
                    const FocalAndDepth& depth) {
  TsaiLens lens;
  lens.focal_m = depth.focal_m;
  lens.cx_px = sensor.cx_px;
  lens.cy_px = sensor.cy_px;
  lens.scale_x = alignment.scale_x;
  lens.pixel_pitch_x_m = sensor.pixel_pitch_x_m;
  lens.pixel_pitch_y_m = sensor.pixel_pitch_y_m;
  Camera camera;
  camera.model.lens = lens;
  camera.cam_from_world = {alignment.rotation, {alignment.tx_m, alignment.ty_m, depth.tz_m}};
  return camera;
}

}  // namespace drape::calib
