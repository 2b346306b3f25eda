// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/planar_view.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "core/geometry/homography.hpp"
#include "core/geometry/rigid_motion.hpp"

namespace drape::calib {

using Eigen::Matrix3d;
using Eigen::Vector2d;

std::optional<Matrix3d> homography_of(const std::vector<TargetPoint>& points) {
  std::vector<Vector2d> from, to;
  for (const TargetPoint& p : points) {
    from.emplace_back(p.point_in_target.head<2>());
    to.emplace_back(p.measured_px);
  }
  return homography(from, to);
}

std::optional<double> focal_px_of(const std::vector<Matrix3d>& homographies,
                                  const Vector2d& principal_px) {
  double square = 0, product = 0;  // sums of a a and a b for the equations a x = b, x = 1/f^2
  for (const Matrix3d& raw : homographies) {
    Matrix3d h = raw;
    h.row(0) -= principal_px.x() * raw.row(2);
    h.row(1) -= principal_px.y() * raw.row(2);
    h /= std::sqrt(h.block<2, 2>(0, 0).norm());
    h /= h.block<2, 2>(0, 0).norm();
    const Vector2d a1 = h.block<2, 1>(0, 0), a2 = h.block<2, 1>(0, 1);
    const double z1 = h(2, 0), z2 = h(2, 1);
    // a1.a2 / f^2 + z1 z2 = 0 and (|a1|^2 - |a2|^2) / f^2 + z1^2 - z2^2 = 0
    const double a[2] = {a1.dot(a2), a1.squaredNorm() - a2.squaredNorm()};
    const double b[2] = {-z1 * z2, z2 * z2 - z1 * z1};
    for (int i = 0; i < 2; ++i) {
      square += a[i] * a[i];
      product += a[i] * b[i];
    }
  }
  const double inverse = product / square;
  if (!(inverse > 0) || !std::isfinite(inverse)) return std::nullopt;
  return 1 / std::sqrt(inverse);
}

PlanarPose planar_pose(const Matrix3d& homography, double focal_px, const Vector2d& principal_px) {
  Matrix3d inverse_k;
  inverse_k << 1 / focal_px, 0, -principal_px.x() / focal_px, 0, 1 / focal_px,
      -principal_px.y() / focal_px, 0, 0, 1;
  Matrix3d a = inverse_k * homography;
  a *= 2 / (a.col(0).norm() + a.col(1).norm());
  Matrix3d axes;
  axes << a.col(0), a.col(1), a.col(0).cross(a.col(1));
  PlanarPose pose;
  pose.cam_from_target = {nearest_rotation(axes), a.col(2)};
  pose.mirrored = pose.cam_from_target.rotation.col(2).dot(a.col(2)) > 0;
  return pose;
}

}  // namespace drape::calib
