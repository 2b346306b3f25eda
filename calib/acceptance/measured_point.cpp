// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/measured_point.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <vector>

#include "core/camera_derivatives.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Seen {
  const Camera* camera = nullptr;
  Index parameters_at = 0;
  const Detection* detection = nullptr;
};

/// The point nearest to all rays.
std::optional<Vector3d> nearest_to_rays(const std::vector<Seen>& views) {
  Matrix3d sum = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const Seen& view : views) {
    const auto in_camera = unproject(view.camera->model, view.detection->centre_px);
    if (!in_camera) return std::nullopt;
    const Vector3d ray = view.camera->cam_from_world.rotation.transpose() * *in_camera;
    const Matrix3d across = Matrix3d::Identity() - ray * ray.transpose();
    sum += across;
    right += across * centre_in_world(*view.camera);
  }
  const Eigen::LDLT<Matrix3d> factor(sum);
  // Two rays closer than about 2 degrees do not meet in a point.
  if (!(factor.vectorD().minCoeff() > 1e-3)) return std::nullopt;
  return factor.solve(right);
}

std::optional<MeasuredPoint> point_from(const std::vector<Seen>& views, Index parameters) {
  auto point = nearest_to_rays(views);
  if (!point) return std::nullopt;
  Matrix3d information;
  Eigen::Matrix3Xd pulled;
  for (int round = 0; round < 6; ++round) {
    information.setZero();
    pulled = Eigen::Matrix3Xd::Zero(3, parameters);
    Vector3d step = Vector3d::Zero();
    for (const Seen& view : views) {
      const auto image = project(view.camera->model, view.camera->cam_from_world * *point);
      const auto by_parameters = d_px_d_parameters(*view.camera, *point);
      if (!image || !by_parameters) return std::nullopt;
      const Eigen::Matrix<double, 2, 3> d =
          image->d_px_d_point * view.camera->cam_from_world.rotation * units::mm;
      const Eigen::Matrix2d weight = view.detection->covariance_px2.inverse();
      information += d.transpose() * weight * d;
      step += d.transpose() * weight * (view.detection->centre_px - image->px);
      pulled.middleCols(view.parameters_at, by_parameters->cols()) =
          -d.transpose() * weight * *by_parameters;
    }
    const Vector3d moved_mm = information.ldlt().solve(step);
    *point += moved_mm * units::mm;
    if (moved_mm.norm() < 1e-9) break;
  }
  const Matrix3d noise = information.inverse();
  if (!noise.allFinite()) return std::nullopt;
  return MeasuredPoint{*point / units::mm, noise, noise * pulled};
}

}  // namespace

std::map<MarkId, MeasuredPoint> measured_points(const Detections& detections,
                                                const Calibration& calibration,
                                                const std::string& set) {
  std::map<MarkId, std::vector<Seen>> views;
  Index at = 0;
  for (const CalibratedCamera& camera : calibration.cameras) {
    for (const FrameDetections& frame : detections.frames) {
      if (frame.set != set || frame.camera != camera.camera.name) continue;
      for (const Detection& d : frame.detections) views[d.mark].push_back({&camera.camera, at, &d});
    }
    at += static_cast<Index>(parameter_names(camera.camera.model).size());
  }
  std::map<MarkId, MeasuredPoint> points;
  for (const auto& [mark, seen] : views) {
    if (seen.size() < 2) continue;
    if (auto point = point_from(seen, at)) points.emplace(mark, std::move(*point));
  }
  return points;
}

}  // namespace drape::calib
