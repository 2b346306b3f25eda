// SPDX-License-Identifier: Apache-2.0
#include "triangulate/dot_normal.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace drape::triangulate {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kStartDirections = 400;  // start directions over the sphere, about 10 degrees apart
constexpr int kSteps = 12;
constexpr double kShapeSigma = 0.02;  // sigma of a squared semi-axis, relative to the dot's own
constexpr double kSizeSigma = 0.03;   // sigma of the size: dots bleed or shrink alike in all views
constexpr double kLargestMisfit = 0.1;

/// Ellipse in one view, and the linear map from the world to its pixels.
struct Outline {
  Eigen::Matrix<double, 2, 3> px_from_world;  ///< image of a dot of unit radius, scaled to order 1
  Matrix2d shape;  ///< squared semi-axes of the ellipse, in the same scale
};

std::optional<Outline> outline_of(const View& view, const Vector3d& in_world, double radius_m) {
  const Camera& camera = view.camera->camera;
  const auto image = project(camera.model, camera.cam_from_world * in_world);
  if (!image || !(view.semi_axes_px.minCoeff() > 0)) return std::nullopt;
  Outline outline;
  outline.px_from_world = radius_m * image->d_px_d_point * camera.cam_from_world.rotation;
  const Vector2d major(std::cos(view.axis_angle_rad), std::sin(view.axis_angle_rad));
  const Vector2d minor(-major.y(), major.x());
  const Vector2d squared = view.semi_axes_px.cwiseAbs2();
  outline.shape = squared[0] * major * major.transpose() + squared[1] * minor * minor.transpose();
  const double scale = outline.px_from_world.squaredNorm() / 2;
  outline.px_from_world /= std::sqrt(scale);
  outline.shape /= scale;
  return outline;
}

/// Misfits of the outlines for a normal and a size factor: three per view, and one that keeps the
/// size near the printed one.
VectorXd misfits(const std::vector<Outline>& outlines, const Vector3d& normal, double size) {
  VectorXd all(3 * outlines.size() + 1);
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    const auto& map = outlines[i].px_from_world;
    const Vector2d shortened = map * normal;
    const Matrix2d predicted = size * (map * map.transpose() - shortened * shortened.transpose());
    const Matrix2d off = (predicted - outlines[i].shape) / kShapeSigma;
    all.segment<3>(3 * static_cast<Eigen::Index>(i)) << off(0, 0), off(1, 1),
        std::numbers::sqrt2 * off(0, 1);
  }
  all[all.size() - 1] = (size - 1) / (2 * kSizeSigma);
  return all;
}

struct DotTilt {
  Vector3d normal;
  double size = 1;
  double cost = 0;
  Matrix3d information;  ///< information matrix of two angles and the size
};

Vector3d turned(const Vector3d& normal, const Vector3d& u, const Vector3d& v, double a, double b) {
  return (normal + a * u + b * v).normalized();
}

/// Refines two angles and the size by Gauss-Newton from an initial direction.
DotTilt refined(const std::vector<Outline>& outlines, DotTilt tilt) {
  constexpr double kDelta = 1e-6;
  for (int step = 0; step < kSteps; ++step) {
    const Vector3d u = tilt.normal.unitOrthogonal(), v = tilt.normal.cross(u);
    const auto at = [&](double a, double b, double size) {
      return misfits(outlines, turned(tilt.normal, u, v, a, b), size);
    };
    const VectorXd now = at(0, 0, tilt.size);
    MatrixXd jacobian(now.size(), 3);
    jacobian.col(0) = (at(kDelta, 0, tilt.size) - at(-kDelta, 0, tilt.size)) / (2 * kDelta);
    jacobian.col(1) = (at(0, kDelta, tilt.size) - at(0, -kDelta, tilt.size)) / (2 * kDelta);
    jacobian.col(2) = (at(0, 0, tilt.size + kDelta) - at(0, 0, tilt.size - kDelta)) / (2 * kDelta);
    tilt.information = jacobian.transpose() * jacobian;
    // A frontal view has no first-order information; damping limits such steps.
    const Vector3d d = (tilt.information + Matrix3d(Vector3d(30, 30, 0).asDiagonal()))
                           .ldlt()
                           .solve(-jacobian.transpose() * now);
    tilt.normal =
        turned(tilt.normal, u, v, std::clamp(d[0], -0.3, 0.3), std::clamp(d[1], -0.3, 0.3));
    tilt.size += d[2];
    if (d.norm() < 1e-9) break;
  }
  tilt.cost = misfits(outlines, tilt.normal, tilt.size).squaredNorm();
  return tilt;
}

/// Evenly distributed directions (spherical Fibonacci lattice).
Vector3d direction(int i) {
  const double z = 1 - (2.0 * i + 1) / kStartDirections;
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0)) * i;
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

/// True if every view sees the printed side.
bool faces(const std::vector<Vector3d>& to_cameras, const Vector3d& normal) {
  for (const Vector3d& to_camera : to_cameras)
    if (normal.dot(to_camera) <= 0) return false;
  return true;
}

}  // namespace

std::optional<DotNormal> normal_from_ellipses(const std::vector<View>& views,
                                              const Vector3d& in_world, double dot_diameter_m) {
  if (views.size() < 2) return std::nullopt;
  std::vector<Outline> outlines;
  std::vector<Vector3d> to_cameras;
  for (const View& view : views) {
    const auto outline = outline_of(view, in_world, dot_diameter_m / 2);
    if (!outline) return std::nullopt;
    outlines.push_back(*outline);
    to_cameras.emplace_back((centre_in_world(view.camera->camera) - in_world).normalized());
  }
  std::optional<DotTilt> best;
  for (int i = 0; i < kStartDirections; ++i) {
    DotTilt start{direction(i), 1, 0, Matrix3d::Zero()};
    if (!faces(to_cameras, start.normal)) continue;
    start.cost = misfits(outlines, start.normal, 1).squaredNorm();
    if (!best || start.cost < best->cost) best = start;
  }
  if (!best) return std::nullopt;
  const DotTilt tilt = refined(outlines, *best);
  const double misfit =
      kShapeSigma * std::sqrt(tilt.cost / static_cast<double>(3 * views.size() + 1));
  if (!(misfit < kLargestMisfit) || !faces(to_cameras, tilt.normal)) return std::nullopt;
  const Matrix3d covariance = tilt.information.inverse();
  const double sigma = std::sqrt(covariance.diagonal().head<2>().maxCoeff());
  if (!std::isfinite(sigma)) return std::nullopt;
  return DotNormal{tilt.normal, sigma, misfit};
}

}  // namespace drape::triangulate
