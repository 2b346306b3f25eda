// SPDX-License-Identifier: Apache-2.0
#include "console/coach/coach.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <numeric>

#include "core/camera_derivatives.hpp"
#include "core/dot_image.hpp"
#include "core/error.hpp"
#include "core/geometry/point.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::console {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
constexpr int kPoseParameters = 6;
constexpr int kLeastPoints = 8;
constexpr double kTilts_deg[] = {-40, -25, 25, 40};  ///< perspective speaks for the lens
constexpr int kPlaces = 3;                           ///< along each axis of the volume
constexpr double kReach = 0.75;  ///< part of the distance from its middle to its sides

std::optional<Projection> seen(const Camera& camera, const Vector3d& point_in_world) {
  auto image = project(camera.model, camera.cam_from_world * point_in_world);
  if (!image || image->px.minCoeff() < 0 || image->px.x() > camera.model.width_px - 1 ||
      image->px.y() > camera.model.height_px - 1)
    return std::nullopt;
  return image;
}

/// Part of the displacements (three rows a point, any columns) moves all points as one body.
MatrixXd rigid_part(const std::vector<Vector3d>& points, const MatrixXd& displacements) {
  MatrixXd body(3 * static_cast<Index>(points.size()), kPoseParameters);
  for (std::size_t k = 0; k < points.size(); ++k) {
    body.middleRows<3>(3 * static_cast<Index>(k)).leftCols<3>() = -cross_matrix(points[k]);
    body.middleRows<3>(3 * static_cast<Index>(k)).rightCols<3>().setIdentity();
  }
  const Eigen::MatrixXd normal = body.transpose() * body;
  return body * normal.ldlt().solve(body.transpose() * displacements);
}

Vector3d corner_of(const Target& target, int k) {
  const int row = k == 0 || k == 1 ? 0 : target.rows - 1;
  const int col = k == 0 || k == 3 ? 0 : target.cols - 1;
  return target.point_in_target({row, col});
}

/// Image of a dot's centre. The centroid of its disc lies beside it (eccentricity; Heikkila, 2000),
/// by how much is known once the pose is.
Vector2d centre_px(const Camera& camera, const Target& target,
                   const std::optional<WorldFromTarget>& pose, const Detection& dot) {
  if (!pose || target.dot_diameter_m == 0) return dot.centre_px;
  const Vector3d centre = camera.cam_from_world * (*pose * target.point_in_target(dot.mark));
  const Matrix3d turn = camera.cam_from_world.rotation * pose->rotation;
  const auto disc = dot_centroid_px(
      camera.model, {centre, turn.col(0), turn.col(1), 0.5 * target.dot_diameter_m});
  const auto image = project(camera.model, centre);
  return disc && image ? Vector2d(dot.centre_px - (*disc - image->px)) : dot.centre_px;
}

std::optional<MeasuredTarget> measure_with(const Calibration& calibration, const Target& target,
                                           const std::vector<FrameDetections>& frames,
                                           const std::optional<WorldFromTarget>& pose) {
  std::map<MarkId, std::vector<Ray>> rays;
  for (const FrameDetections& frame : frames) {
    const auto found =
        std::find_if(calibration.cameras.begin(), calibration.cameras.end(),
                     [&](const CalibratedCamera& c) { return c.camera.name == frame.camera; });
    if (found == calibration.cameras.end()) continue;
    for (const Detection& dot : frame.detections)
      if (const auto ray = ray_of(found->camera, centre_px(found->camera, target, pose, dot)))
        rays[dot.mark].push_back(*ray);
  }
  MeasuredTarget result;
  Eigen::Matrix3Xd drawn(3, rays.size()), measured(3, rays.size());
  for (const auto& [mark, seen_along] : rays) {
    const auto point = nearest_to_rays(seen_along);
    if (!point) continue;
    drawn.col(result.points) = target.point_in_target(mark);
    measured.col(result.points++) = *point;
  }
  if (result.points < kLeastPoints) return std::nullopt;
  drawn.conservativeResize(3, result.points);
  measured.conservativeResize(3, result.points);
  const auto pose_of_points = pose_from_points<frame::World, frame::Target>(drawn, measured);
  if (!pose_of_points) return std::nullopt;
  result.world_from_target = *pose_of_points;
  double sum = 0;
  for (Index k = 0; k < measured.cols(); ++k) {
    sum += (result.world_from_target * Vector3d(drawn.col(k)) - measured.col(k)).squaredNorm();
    result.points_in_world.emplace_back(measured.col(k));
  }
  result.rms_m = std::sqrt(sum / result.points);
  return result;
}

}  // namespace

std::optional<MeasuredTarget> measure_target(const Calibration& calibration, const Target& target,
                                             const std::vector<FrameDetections>& frames) {
  const auto first = measure_with(calibration, target, frames, {});
  return first ? measure_with(calibration, target, frames, first->world_from_target) : first;
}

Coach::Coach(Calibration calibration, Target target, const Volume& volume,
             std::vector<double> sigma_px)
    : calibration_(std::move(calibration)),
      target_(std::move(target)),
      volume_(volume),
      sigma_px_(std::move(sigma_px)) {
  Index size = 0;
  for (const CalibratedCamera& camera : calibration_.cameras) {
    offsets_.push_back(size);
    size += static_cast<Index>(parameter_names(camera.camera.model).size());
  }
  if (calibration_.joint_covariance.rows() != size)
    throw bad_input("the calibration has no covariance of all cameras together", {},
                    "calibrate with --method joint");
  constexpr int kSteps = 3;
  double sum = 0;
  for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
    const int row = i / kSteps, layer = row / kSteps;
    const Vector3d part(i % kSteps, row % kSteps, layer);
    const Vector3d point =
        volume_.low + (volume_.high - volume_.low).cwiseProduct(part / (kSteps - 1));
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
  if (grid_.empty())
    throw bad_input("no two cameras see the volume in which cloths are measured", {},
                    "turn the cameras towards the object");
  gains_ -= rigid_part(grid_, gains_);
  marks_m_ = std::sqrt(sum / static_cast<double>(grid_.size()));
}

double Coach::calibration_sd(const MatrixXd& covariance) const {
  const double sum = (gains_ * covariance).cwiseProduct(gains_).sum();
  return std::sqrt(sum / static_cast<double>(grid_.size()));
}

PredictedError Coach::now() const {
  return {calibration_sd(calibration_.joint_covariance), marks_m_};
}

std::optional<Vector2d> Coach::pixel(std::size_t camera, const Vector3d& point_in_world) const {
  const auto image = seen(calibration_.cameras[camera].camera, point_in_world);
  return image ? std::optional(image->px) : std::nullopt;
}

std::optional<MatrixXd> Coach::information(const WorldFromTarget& pose,
                                           std::vector<int>& cameras) const {
  const Index size = calibration_.joint_covariance.rows();
  MatrixXd all = MatrixXd::Zero(size + kPoseParameters, size + kPoseParameters);
  for (std::size_t c = 0; c < calibration_.cameras.size(); ++c) {
    bool whole = true;
    for (int k = 0; k < 4; ++k) whole = whole && pixel(c, pose * corner_of(target_, k));
    if (!whole) continue;
    cameras.push_back(static_cast<int>(c));
    const Camera& camera = calibration_.cameras[c].camera;
    for (int row = 0; row < target_.rows; ++row) {
      for (int col = 0; col < target_.cols; ++col) {
        const Vector3d in_target = target_.point_in_target({row, col});
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
  }
  if (cameras.size() < 2) return std::nullopt;
  const MatrixXd of_pose = all.bottomRightCorner<kPoseParameters, kPoseParameters>();
  const MatrixXd mixed = all.topRightCorner(size, kPoseParameters);
  return all.topLeftCorner(size, size) - mixed * of_pose.ldlt().solve(mixed.transpose());
}

std::optional<NextPose> Coach::next() const {
  const MatrixXd& covariance = calibration_.joint_covariance;
  const MatrixXd one = MatrixXd::Identity(covariance.rows(), covariance.rows());
  const Vector3d middle = 0.5 * (volume_.low + volume_.high);
  const Vector3d half = 0.5 * (volume_.high - volume_.low);
  std::optional<NextPose> best;
  double best_m = now().calibration_m;
  for (int place = 0; place < kPlaces * kPlaces * kPlaces; ++place) {
    const int row = place / kPlaces, layer = row / kPlaces;
    const Vector3d at(place % kPlaces - 1, row % kPlaces - 1, layer - 1);
    for (const double tilt_deg : kTilts_deg) {
      for (int about = 0; about < 2; ++about) {
        NextPose pose;
        const Vector3d axis = about == 0 ? Vector3d::UnitX() : Vector3d::UnitY();
        pose.world_from_target.rotation =
            Eigen::AngleAxisd(tilt_deg * units::deg, axis).toRotationMatrix();
        pose.world_from_target.translation_m = middle + kReach * at.cwiseProduct(half);
        const auto more = information(pose.world_from_target, pose.cameras);
        if (!more) continue;
        // (C^-1 + M)^-1 without inverting C: parameters that were not fitted have none.
        const MatrixXd then = (one + covariance * *more).partialPivLu().solve(covariance);
        pose.calibration_m = calibration_sd(then);
        if (!(pose.calibration_m < best_m)) continue;
        best_m = pose.calibration_m;
        const Vector3d centre = pose.world_from_target.translation_m / units::mm;
        pose.words = fmt::format(
            "tilted by {:+.0f} deg about its {} axis, centre at ({:.0f}, {:.0f}, {:.0f}) "
            "mm",
            tilt_deg, about == 0 ? "x" : "y", centre.x() + 0.0, centre.y() + 0.0, centre.z() + 0.0);
        best = pose;
      }
    }
  }
  if (!best) return std::nullopt;
  for (const int c : best->cameras) {
    auto& outline = best->outline_px.emplace_back();
    constexpr int kAlong = 8;  // a lens bends the edges
    for (int k = 0; k < 4; ++k) {
      const Vector3d from = corner_of(target_, k), to = corner_of(target_, (k + 1) % 4);
      for (int i = 0; i < kAlong; ++i) {
        const Vector3d point = from + (to - from) * i / kAlong;
        if (const auto px = pixel(static_cast<std::size_t>(c), best->world_from_target * point))
          outline.push_back(*px);
      }
    }
  }
  return best;
}

}  // namespace drape::console
