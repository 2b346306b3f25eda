// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/planar_view.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

namespace drape::calib {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Moves the mean to 0 and the mean distance to sqrt(2).
Matrix3d normaliser(const std::vector<Vector2d>& points) {
  Vector2d mean = Vector2d::Zero();
  for (const Vector2d& p : points) mean += p / static_cast<double>(points.size());
  double distance = 0;
  for (const Vector2d& p : points)
    distance += (p - mean).norm() / static_cast<double>(points.size());
  const double scale = std::sqrt(2.0) / distance;
  Matrix3d n;
  n << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  return n;
}

}  // namespace

std::optional<Matrix3d> homography_of(const std::vector<TargetPoint>& points) {
  if (points.size() < 4) return std::nullopt;
  std::vector<Vector2d> from, to;
  for (const TargetPoint& p : points) {
    from.emplace_back(p.point_in_target.head<2>());
    to.emplace_back(p.measured_px);
  }
  const Matrix3d from_normal = normaliser(from), to_normal = normaliser(to);
  if (!from_normal.allFinite() || !to_normal.allFinite()) return std::nullopt;
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d a = from_normal * from[i].homogeneous();
    const Vector3d b = to_normal * to[i].homogeneous();
    Eigen::Matrix<double, 2, 9> rows;
    rows << a.transpose(), Eigen::RowVector3d::Zero(), -b.x() * a.transpose(),
        Eigen::RowVector3d::Zero(), a.transpose(), -b.y() * a.transpose();
    normal += rows.transpose() * rows;
  }
  const Eigen::JacobiSVD<Eigen::Matrix<double, 9, 9>> svd(normal, Eigen::ComputeFullV);
  // Two vanishing singular values: the points lie on one line.
  if (!(svd.singularValues()[7] > 1e-9 * svd.singularValues()[0])) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = svd.matrixV().col(8);
  Matrix3d normalised;
  normalised << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  Matrix3d result = to_normal.inverse() * normalised * from_normal;
  // The scale's sign puts the target's middle in front of the camera.
  if ((result * from_normal.inverse().col(2)).z() < 0) result = -result;
  return result / result.norm();
}

std::optional<double> focal_px_of(const std::vector<Matrix3d>& homographies,
                                  const Vector2d& principal_px) {
  double square = 0, product = 0;  // of a x = b with x = 1/f^2
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
  const Eigen::JacobiSVD<Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  PlanarPose pose;
  pose.cam_from_target = {svd.matrixU() * svd.matrixV().transpose(), a.col(2)};
  pose.mirrored = pose.cam_from_target.rotation.col(2).dot(a.col(2)) > 0;
  return pose;
}

}  // namespace drape::calib
