// SPDX-License-Identifier: Apache-2.0
#include "triangulate/plate/plate_pose.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <map>

#include "core/camera_derivatives.hpp"
#include "core/dot_image.hpp"
#include "core/error.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr Eigen::Index kLeastDots = 4;
constexpr int kPoseSteps = 50;
constexpr double kStill = 1e-12;  // converged, m and rad

Vector3d in_plate(const MarkLattice& lattice, MarkId mark) {
  return lattice.pitch_m *
         Vector3d(mark.col - 0.5 * (lattice.cols - 1), mark.row - 0.5 * (lattice.rows - 1), 0);
}

WorldFromObject start_of(const std::vector<MarkViews>& marks, const MarkLattice& lattice) {
  constexpr double kLeastAngle = 2 * units::deg;
  Eigen::Matrix3Xd from(3, marks.size()), to(3, marks.size());
  Eigen::Index count = 0;
  for (const MarkViews& mark : marks) {
    const auto at = midpoint(mark.views, kLeastAngle);
    if (!at) continue;
    from.col(count) = in_plate(lattice, mark.mark);
    to.col(count++) = *at;
  }
  const auto pose =
      pose_from_points<frame::World, frame::Object>(from.leftCols(count), to.leftCols(count));
  if (count < kLeastDots || !pose)
    throw bad_input(fmt::format("{} dots of the plate are seen by two cameras, {} are needed",
                                count, kLeastDots),
                    {}, "show the plate to two cameras at once");
  return *pose;
}

/// Normal equations over all views; derivative of the right-hand side by the cameras' parameters.
struct Normal {
  Matrix6 matrix = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  MatrixXd by_cameras;  ///< 6 x number of parameters
  double chi2 = 0, squares_px2 = 0;
  int views = 0;
};

/// Columns of each camera's parameters in the joint covariance.
struct CameraColumns {
  MatrixXd covariance = MatrixXd(0, 0);
  std::map<const CalibratedCamera*, std::vector<Eigen::Index>> places;
};

CameraColumns columns_of(const std::vector<MarkViews>& marks) {
  CameraColumns all;
  for (const MarkViews& mark : marks) {
    for (const View& view : mark.views) {
      if (all.places.count(view.camera) != 0) continue;
      std::vector<Eigen::Index>& places = all.places[view.camera];
      if (view.joint != nullptr) {
        places = view.joint->places;
        all.covariance = *view.joint->covariance;
        continue;
      }
      const MatrixXd& own = view.camera->covariance;
      const Eigen::Index at = all.covariance.rows();
      MatrixXd larger = MatrixXd::Zero(at + own.rows(), at + own.rows());
      larger.topLeftCorner(at, at) = all.covariance;
      larger.bottomRightCorner(own.rows(), own.rows()) = own;
      all.covariance = larger;
      for (Eigen::Index k = 0; k < own.rows(); ++k) places.push_back(at + k);
    }
  }
  return all;
}

Normal normal_of(const std::vector<MarkViews>& marks, const MarkLattice& lattice,
                 const WorldFromObject& pose, const CameraColumns& cameras) {
  Normal normal;
  normal.by_cameras = MatrixXd::Zero(6, cameras.covariance.rows());
  for (const MarkViews& mark : marks) {
    const Vector3d from_origin = pose.rotation * in_plate(lattice, mark.mark);
    const Vector3d at = pose.translation_m + from_origin;
    for (const View& view : mark.views) {
      const Camera& camera = view.camera->camera;
      const Matrix3d& turn = camera.cam_from_world.rotation;
      const Vector3d in_camera = camera.cam_from_world * at;
      const auto image = project(camera.model, in_camera);
      const auto seen =
          dot_centroid_px(camera.model, {in_camera, turn * pose.rotation.col(0),
                                         turn * pose.rotation.col(1), lattice.dot_diameter_m / 2});
      if (!image || !seen) continue;
      Eigen::Matrix<double, 2, 6> jacobian;
      jacobian.leftCols<3>() = image->d_px_d_point * turn;
      jacobian.rightCols<3>() = -jacobian.leftCols<3>() * cross_matrix(from_origin);
      const Eigen::Matrix2d weight = view.covariance_px2.inverse();
      const Vector2d residual = view.px - *seen;
      normal.matrix += jacobian.transpose() * weight * jacobian;
      normal.right += jacobian.transpose() * weight * residual;
      normal.chi2 += residual.dot(weight * residual);
      normal.squares_px2 += residual.squaredNorm();
      ++normal.views;
      const auto by_parameters = d_px_d_parameters(camera, at);
      const std::vector<Eigen::Index>& places = cameras.places.at(view.camera);
      if (!by_parameters) continue;
      for (std::size_t k = 0; k < places.size(); ++k) {
        if (places[k] < 0 || static_cast<Eigen::Index>(k) >= by_parameters->cols()) continue;
        normal.by_cameras.col(places[k]) +=
            jacobian.transpose() * weight * by_parameters->col(static_cast<Eigen::Index>(k));
      }
    }
  }
  return normal;
}

}  // namespace

PlatePose plate_pose(const std::vector<MarkViews>& marks, const MarkLattice& lattice) {
  PlatePose result;
  WorldFromObject& pose = result.world_from_plate;
  pose = start_of(marks, lattice);
  const CameraColumns cameras = columns_of(marks);
  Normal normal;
  double step_size = 1;
  for (int step = 0; step < kPoseSteps && step_size > kStill; ++step) {
    normal = normal_of(marks, lattice, pose, cameras);
    const Vector6 by = normal.matrix.ldlt().solve(normal.right);
    pose.translation_m += by.head<3>();
    pose.rotation = rotation_about(by.tail<3>()) * pose.rotation;
    step_size = by.norm();
  }
  if (!(step_size < 1e-9))
    throw bad_input("the pose of the plate does not converge", {},
                    "look at the detections: is the plate the one that is described?");
  const Matrix6 inverse = normal.matrix.inverse();
  const Eigen::Matrix<double, 6, Eigen::Dynamic> by_cameras = inverse * normal.by_cameras;
  for (const MarkViews& mark : marks) result.dots += mark.views.empty() ? 0 : 1;
  result.views = normal.views;
  result.rms_px = std::sqrt(normal.squares_px2 / normal.views);
  result.chi2_per_dof = normal.chi2 / (2 * normal.views - 6);
  // A plate is flat with many dots, so their actual scatter is estimated, not assumed (Birge 1932).
  result.covariance =
      result.chi2_per_dof * inverse + by_cameras * cameras.covariance * by_cameras.transpose();
  return result;
}

PlatePose plate_pose(const Detections& detections, const Calibration& calibration,
                     const std::string& set, double floor_px) {
  if (detections.lattice.surface != Surface::target)
    throw bad_input("the detections show a cloth, not a plate", {.set = set},
                    "detect the set with --surface target and the plate's description");
  const JointPlaces places = joint_places(calibration);
  return plate_pose(collect_views(detections, calibration, places, set, floor_px),
                    detections.lattice);
}

}  // namespace drape::triangulate
