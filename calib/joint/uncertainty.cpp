// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/uncertainty.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "core/camera_derivatives.hpp"
#include "core/units.hpp"

namespace drape::calib {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

WorldBox drape_volume(const JointModel& model) {
  double top = 0;
  for (const Placement& placement : model.placements) {
    if (placement.known) top = std::max(top, placement.world_from_target.translation_m.z());
  }
  const Eigen::Vector2d half = model.board.half_m;
  return {{-half.x(), -half.y(), 0}, {half.x(), half.y(), top}};
}

std::optional<double> projected_sd_px(const CalibratedCamera& camera,
                                      const Vector3d& point_in_world) {
  const auto d = d_px_d_parameters(camera.camera, point_in_world);
  if (!d || camera.covariance.rows() != d->cols()) return std::nullopt;
  return std::sqrt((*d * camera.covariance * d->transpose()).trace() / 2);
}

std::optional<Eigen::Matrix3d> point_covariance_mm2(const Calibration& calibration,
                                                    const Vector3d& point_in_world) {
  const Index parameters = calibration.joint_covariance.rows();
  MatrixXd pulled = MatrixXd::Zero(3, parameters);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  // px^2 per mm^2
  Index offset = 0;
  int seen = 0;
  for (const CalibratedCamera& calibrated : calibration.cameras) {
    const Camera& camera = calibrated.camera;
    const auto width = static_cast<Index>(parameter_names(camera.model).size());
    if (offset + width > parameters) return std::nullopt;
    const auto d = d_px_d_parameters(camera, point_in_world);
    const auto image = project(camera.model, camera.cam_from_world * point_in_world);
    if (d && image) {
      const Eigen::Matrix<double, 2, 3> by_point =
          image->d_px_d_point * camera.cam_from_world.rotation * units::mm;
      information += by_point.transpose() * by_point;
      pulled.middleCols(offset, width) = by_point.transpose() * *d;
      ++seen;
    }
    offset += width;
  }
  if (seen < 2) return std::nullopt;
  const MatrixXd moves = information.ldlt().solve(pulled);
  return Eigen::Matrix3d(moves * calibration.joint_covariance * moves.transpose());
}

std::optional<double> volume_sd_mm(const Calibration& calibration,
                                   const std::vector<Vector3d>& points) {
  double sum = 0;
  int count = 0;
  for (const Vector3d& point : points) {
    if (const auto covariance = point_covariance_mm2(calibration, point)) {
      sum += covariance->trace();
      ++count;
    }
  }
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / count);
}

}  // namespace drape::calib
