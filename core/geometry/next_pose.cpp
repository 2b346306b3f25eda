// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/next_pose.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kPoseParameters = 6;
constexpr int kGridNodes = 3;                        ///< per edge of the volume
constexpr double kTilts_deg[] = {-40, -25, 25, 40};  ///< perspective of a tilt constrains the lens
constexpr double kReach = 0.75;  ///< fraction of the way from the volume's centre to its faces

std::optional<Projection> seen(const Camera& camera, const Vector3d& point_in_world) {
  auto image = project(camera.model, camera.cam_from_world * point_in_world);
  if (!image || image->px.minCoeff() < 0 || image->px.x() > camera.model.width_px - 1 ||
      image->px.y() > camera.model.height_px - 1)
    return std::nullopt;
  return image;
}

/// Projects displacements (three rows per point, any number of columns) onto common rigid motions.
MatrixXd rigid_part(const std::vector<Vector3d>& points, const MatrixXd& displacements) {
  MatrixXd body(3 * static_cast<Index>(points.size()), kPoseParameters);
  for (std::size_t k = 0; k < points.size(); ++k) {
    body.middleRows<3>(3 * static_cast<Index>(k)).leftCols<3>() = -cross_matrix(points[k]);
    body.middleRows<3>(3 * static_cast<Index>(k)).rightCols<3>().setIdentity();
  }
  return body *
         solve_symmetric(body.transpose() * body, MatrixXd(body.transpose() * displacements));
}

}  // namespace

std::vector<Vector3d> grid_of(const WorldBox& box, int nodes_per_side) {
  std::vector<Vector3d> nodes;
  const double last = nodes_per_side - 1;
  for (int k = 0; k < nodes_per_side; ++k)
    for (int j = 0; j < nodes_per_side; ++j)
      for (int i = 0; i < nodes_per_side; ++i)
        nodes.emplace_back(box.low + (box.high - box.low).cwiseProduct(Vector3d(i, j, k) / last));
  return nodes;
}

std::vector<Vector3d> points_of(const Target& target) {
  std::vector<Vector3d> points;
  for (int row = 0; row < target.rows; ++row)
    for (int col = 0; col < target.cols; ++col)
      points.push_back(target.point_in_target({row, col}));
  return points;
}

PosePlanner::PosePlanner(Calibration calibration, std::vector<Vector3d> points_in_target,
                         const WorldBox& volume, std::vector<double> sigma_px)
    : calibration_(std::move(calibration)),
      points_in_target_(std::move(points_in_target)),
      volume_(volume),
      sigma_px_(std::move(sigma_px)) {
  Eigen::AlignedBox3d extent;
  for (const Vector3d& point : points_in_target_) extent.extend(point);
  for (const int corner : {0, 1, 3, 2})
    corners_.push_back(extent.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  Index size = 0;
  for (const CalibratedCamera& camera : calibration_.cameras) {
    offsets_.push_back(size);
    size += static_cast<Index>(parameter_names(camera.camera.model).size());
  }
  if (calibration_.joint_covariance.rows() != size)
    throw bad_input("the calibration has no covariance of all cameras together", {},
                    "calibrate with --method joint");
  double sum = 0;
  for (const Vector3d& point : grid_of(volume_, kGridNodes)) {
    Matrix3d normal = Matrix3d::Zero(), noise = Matrix3d::Zero();
    MatrixXd by_parameters = MatrixXd::Zero(3, size);
    int cameras = 0;
    for (std::size_t c = 0; c < calibration_.cameras.size(); ++c) {
      const Camera& camera = calibration_.cameras[c].camera;
      const auto image = seen(camera, point);
      const auto derivative = d_px_d_parameters(camera, point);
      if (!image || !derivative) continue;
      const Eigen::Matrix<double, 2, 3> d = image->d_px_d_point * camera.cam_from_world.rotation;
      normal += d.transpose() * d;
      noise += sigma_px_[c] * sigma_px_[c] * d.transpose() * d;
      by_parameters.middleCols(offsets_[c], derivative->cols()) = d.transpose() * *derivative;
      ++cameras;
    }
    if (cameras < 2) continue;
    const Matrix3d inverse = normal.inverse();
    grid_.push_back(point);
    gains_.conservativeResize(gains_.rows() + 3, size);
    gains_.bottomRows<3>() = inverse * by_parameters;
    sum += (inverse * noise * inverse).trace();
  }
  if (grid_.empty()) return;
  gains_ -= rigid_part(grid_, gains_);
  marks_m_ = std::sqrt(sum / static_cast<double>(grid_.size()));
}

double PosePlanner::calibration_sd(const MatrixXd& covariance) const {
  const double sum = (gains_ * covariance).cwiseProduct(gains_).sum();
  return std::sqrt(sum / static_cast<double>(grid_.size()));
}

PredictedError PosePlanner::now() const {
  return {calibration_sd(calibration_.joint_covariance), marks_m_};
}

std::optional<MatrixXd> PosePlanner::information(const WorldFromTarget& pose,
                                                 std::vector<int>& cameras) const {
  const Index size = calibration_.joint_covariance.rows();
  MatrixXd all = MatrixXd::Zero(size + kPoseParameters, size + kPoseParameters);
  for (std::size_t c = 0; c < calibration_.cameras.size(); ++c) {
    const Camera& camera = calibration_.cameras[c].camera;
    if (!std::all_of(corners_.begin(), corners_.end(), [&](const Vector3d& corner) {
          return seen(camera, pose * corner).has_value();
        }))
      continue;
    cameras.push_back(static_cast<int>(c));
    for (const Vector3d& in_target : points_in_target_) {
      const auto image = seen(camera, pose * in_target);
      const auto derivative = d_px_d_parameters(camera, pose * in_target);
      if (!image || !derivative) continue;
      const Eigen::Matrix<double, 2, 3> d = image->d_px_d_point * camera.cam_from_world.rotation;
      Eigen::Matrix<double, 2, kPoseParameters> by_pose;
      by_pose << -d * cross_matrix(pose.rotation * in_target), d;
      const Index at = offsets_[c], count = derivative->cols();
      const double weight = 1 / (sigma_px_[c] * sigma_px_[c]);
      all.block(at, at, count, count) += weight * derivative->transpose() * *derivative;
      all.block(at, size, count, kPoseParameters) += weight * derivative->transpose() * by_pose;
      all.bottomRightCorner<kPoseParameters, kPoseParameters>() +=
          weight * by_pose.transpose() * by_pose;
    }
  }
  if (cameras.size() < 2) return std::nullopt;
  const MatrixXd of_pose = all.bottomRightCorner<kPoseParameters, kPoseParameters>();
  const MatrixXd mixed = all.topRightCorner(size, kPoseParameters);
  return all.topLeftCorner(size, size) -
         mixed * solve_symmetric(of_pose, MatrixXd(mixed.transpose()));
}

std::vector<std::vector<Vector2d>> PosePlanner::outlines(const NextPose& pose) const {
  constexpr int kAlong = 8;  // points per edge, since a lens bends the edges
  std::vector<std::vector<Vector2d>> outlines;
  for (const int c : pose.cameras) {
    auto& outline = outlines.emplace_back();
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      const Vector3d along = corners_[(k + 1) % corners_.size()] - corners_[k];
      for (int i = 0; i < kAlong; ++i) {
        const Vector3d point = corners_[k] + along * i / kAlong;
        if (const auto image = seen(calibration_.cameras[static_cast<std::size_t>(c)].camera,
                                    pose.world_from_target * point))
          outline.push_back(image->px);
      }
    }
  }
  return outlines;
}

std::optional<NextPose> PosePlanner::next(int places_per_side) const {
  if (grid_.empty()) return std::nullopt;
  const MatrixXd& covariance = calibration_.joint_covariance;
  const MatrixXd one = MatrixXd::Identity(covariance.rows(), covariance.rows());
  const Vector3d middle = 0.5 * (volume_.low + volume_.high);
  const Vector3d reach = 0.5 * kReach * (volume_.high - volume_.low);
  std::optional<NextPose> best;
  double best_m = now().calibration_m;
  for (const Vector3d& place : grid_of({middle - reach, middle + reach}, places_per_side)) {
    for (const double tilt_deg : kTilts_deg) {
      for (const int axis : {0, 1}) {
        NextPose pose;
        pose.world_from_target = {rotation_about(tilt_deg * units::deg * Vector3d::Unit(axis)),
                                  place};
        const auto more = information(pose.world_from_target, pose.cameras);
        if (!more) continue;
        // (C^-1 + M)^-1 without inverting C, which is singular for parameters that were not fitted.
        const MatrixXd then = (one + covariance * *more).partialPivLu().solve(covariance);
        pose.calibration_m = calibration_sd(then);
        if (!(pose.calibration_m < best_m)) continue;
        best_m = pose.calibration_m;
        const Vector3d centre = place / units::mm;
        pose.words = fmt::format(
            "tilted by {:+.0f} deg about its {} axis, centre at ({:.0f}, {:.0f}, {:.0f}) mm",
            tilt_deg, "xy"[axis], centre.x() + 0.0, centre.y() + 0.0, centre.z() + 0.0);
        best = pose;
      }
    }
  }
  if (best) best->outline_px = outlines(*best);
  return best;
}

}  // namespace drape
