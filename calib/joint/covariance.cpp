// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/covariance.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/camera_derivatives.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr Index kFileParameters = 15;  ///< Brown's nine and the pose; the skew has no place there

/// File index of a parameter of joint_model.hpp, -1 for the skew.
Index file_index(int parameter) {
  if (parameter == lens_parameters - 1) return -1;
  return parameter < lens_parameters ? parameter : parameter - 1;
}

/// d(file parameters) / d(moved parameters): a turn becomes a change of the rotation vector.
MatrixXd to_file(const JointModel& model, const std::vector<int>& moved, Index size) {
  MatrixXd map = MatrixXd::Zero(kFileParameters * static_cast<Index>(model.cameras.size()), size);
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const Eigen::AngleAxisd turn(model.cameras[c].camera.cam_from_world.rotation);
    const Eigen::Matrix3d to_vector = left_jacobian(turn.angle() * turn.axis()).inverse();
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const Index column = static_cast<Index>(c * moved.size() + i);
      const Index row = file_index(moved[i]);
      const Index first = kFileParameters * static_cast<Index>(c);
      const int axis = moved[i] - lens_parameters;
      if (axis >= 0 && axis < 3) {
        map.block<3, 1>(first + lens_parameters - 1, column) = to_vector.col(axis);
      } else if (row >= 0) {
        map(first + row, column) = 1;
      }
    }
  }
  return map;
}

}  // namespace

JointCovariance joint_covariance(const JointModel& model, const JointFit& fit,
                                 const MatrixXd& information, const MatrixXd& common,
                                 double variance_factor) {
  JointCovariance out;
  MatrixXd all = variance_factor * inverse_of_information(information);
  if (all.size() == 0) return out;
  if (common.size() > 0) all += all * common * all.transpose() / variance_factor;
  const std::vector<int> moved = moved_camera_parameters(fit);
  const auto cameras = static_cast<Index>(moved.size() * model.cameras.size());
  const MatrixXd map = to_file(model, moved, cameras);
  out.cameras = map * all.topLeftCorner(cameras, cameras) * map.transpose();
  if (fit.bow) out.bow_sd_mm = all.diagonal().segment<bow_parameters>(cameras).cwiseSqrt();
  for (const JointCamera& camera : model.cameras) {
    for (const std::string& name : parameter_names(camera.camera.model))
      out.names.push_back(camera.camera.name + "/" + name);
  }
  return out;
}

void add_scale_uncertainty(MatrixXd& covariance, const JointModel& model,
                           double scale_uncertainty) {
  if (covariance.size() == 0) return;
  Eigen::VectorXd growth = Eigen::VectorXd::Zero(covariance.rows());
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    growth.segment<3>(kFileParameters * static_cast<Index>(c) + kFileParameters - 3) =
        model.cameras[c].camera.cam_from_world.translation_m / units::mm;
  }
  covariance += scale_uncertainty * scale_uncertainty * growth * growth.transpose();
}

Eigen::Matrix3d centre_covariance_mm2(const CalibratedCamera& camera) {
  // centre = -R' t; a turn w on top of R makes it -R' (1 - [w]x) t.
  const CamFromWorld& pose = camera.camera.cam_from_world;
  const Eigen::AngleAxisd turn(pose.rotation);
  const Eigen::Vector3d t = pose.translation_m / units::mm;
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  Eigen::Matrix<double, 3, 6> d;
  d << pose.rotation.transpose() * -cross * left_jacobian(turn.angle() * turn.axis()),
      -pose.rotation.transpose();
  return d * camera.covariance.bottomRightCorner<6, 6>() * d.transpose();
}

}  // namespace drape::calib
