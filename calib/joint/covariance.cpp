// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/covariance.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/camera_derivatives.hpp"
#include "core/error.hpp"
#include "core/geometry/dense.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kFileParameters = 15;  ///< nine of Brown's lens and the pose; files have no skew

/// File index of a model parameter; -1 for the skew.
Index file_index(int parameter) {
  if (parameter == lens_parameters - 1) return -1;
  return parameter < lens_parameters ? parameter : parameter - 1;
}

/// d(file parameters) / d(free parameters): converts a rotation to a change of the rotation vector.
MatrixXd to_file(const JointModel& model, const std::vector<int>& moved, Index size) {
  MatrixXd map = MatrixXd::Zero(kFileParameters * static_cast<Index>(model.cameras.size()), size);
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const Eigen::Matrix3d to_vector =
        left_jacobian(rotation_vector(model.cameras[c].camera.cam_from_world.rotation)).inverse();
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
                                 const MatrixXd& all) {
  JointCovariance out;
  if (all.size() == 0) return out;
  const std::vector<int> moved = moved_camera_parameters(fit);
  const auto cameras = static_cast<Index>(moved.size() * model.cameras.size());
  const MatrixXd map = to_file(model, moved, cameras);
  out.cameras = map * all.topLeftCorner(cameras, cameras) * map.transpose();
  const std::vector<int> board = moved_board_parameters(model, fit);
  const auto by_board = static_cast<Index>(board.size());
  const MatrixXd along = map * all.block(0, cameras, cameras, by_board);
  out.target = MatrixXd::Zero(map.rows(), map.rows());
  if (by_board > 0) {
    // C_cb C_bb^-1 C_bc (c cameras, b board) as R R^T: rounding leaves it symmetric and positive.
    const MatrixXd own = all.block(cameras, cameras, by_board, by_board);
    const Eigen::VectorXd per_sd = own.diagonal().cwiseSqrt().cwiseInverse();
    const SymmetricEigen parts = symmetric_eigen(per_sd.asDiagonal() * own * per_sd.asDiagonal());
    const MatrixXd root = along * per_sd.asDiagonal() * parts.vectors *
                          parts.values.cwiseSqrt().cwiseInverse().asDiagonal();
    out.target = root * root.transpose();
  }
  for (std::size_t i = 0; i < board.size(); ++i)
    out.board_sd[board[i]] =
        std::sqrt(all(cameras + static_cast<Index>(i), cameras + static_cast<Index>(i)));
  for (const JointCamera& camera : model.cameras) {
    for (const std::string& name : parameter_names(camera.camera.model))
      out.names.push_back(camera.camera.name + "/" + name);
  }
  return out;
}

Eigen::VectorXd file_difference(const JointModel& a, const JointModel& b) {
  Eigen::VectorXd difference(kFileParameters * static_cast<Index>(a.cameras.size()));
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    const auto &one = std::get<BrownLens>(a.cameras[c].camera.model.lens),
               &two = std::get<BrownLens>(b.cameras[c].camera.model.lens);
    const CamFromWorld &from = b.cameras[c].camera.cam_from_world,
                       &to = a.cameras[c].camera.cam_from_world;
    const Eigen::Vector3d turn = rotation_vector(to.rotation * from.rotation.transpose());
    auto part = difference.segment<kFileParameters>(kFileParameters * static_cast<Index>(c));
    part << one.fx_px - two.fx_px, one.fy_px - two.fy_px, one.cx_px - two.cx_px,
        one.cy_px - two.cy_px, one.k1 - two.k1, one.k2 - two.k2, one.p1 - two.p1, one.p2 - two.p2,
        one.k3 - two.k3, left_jacobian(rotation_vector(from.rotation)).inverse() * turn,
        (to.translation_m - from.translation_m) / units::mm;
  }
  return difference;
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

void use_lenses(JointModel& model, const Calibration& known) {
  for (JointCamera& camera : model.cameras) {
    const Where where{.camera = camera.camera.name};
    const CameraModel& lens = known.camera(camera.camera.name).camera.model;
    if (lens.width_px != camera.camera.model.width_px ||
        lens.height_px != camera.camera.model.height_px) {
      throw bad_input("the known lens was calibrated at another image size", where,
                      "calibrate the lens at the size that the rig records");
    }
    if (!std::holds_alternative<BrownLens>(lens.lens)) {
      throw bad_input("the known lens is Tsai's", where, "calibrate the lens with --method joint");
    }
    camera.camera.model.lens = lens.lens;
  }
}

void add_known_lenses(MatrixXd& covariance, const JointModel& model, JointFit fit,
                      const Calibration& known) {
  constexpr Index kLens = kFileParameters - 6;
  if (covariance.size() == 0) return;
  fit.lens_known = false;
  fit.lens = LensTerms::k1_k2_p1_p2_k3;
  const std::vector<int> moved = moved_camera_parameters(fit);
  const auto cameras = static_cast<Index>(model.cameras.size());
  const MatrixXd information = information_by_view(model, fit).sum();
  std::vector<Index> lens, pose;
  for (Index i = 0; i < information.rows(); ++i) {
    const bool of_lens = i < kFileParameters * cameras && i % kFileParameters < kLens;
    (of_lens ? lens : pose).push_back(i);
  }
  MatrixXd follows = MatrixXd::Zero(information.rows(), static_cast<Index>(lens.size()));
  follows(lens, Eigen::all).setIdentity();
  follows(pose, Eigen::all) =
      -solve_symmetric(information(pose, pose), MatrixXd(information(pose, lens)));
  MatrixXd own = MatrixXd::Zero(follows.cols(), follows.cols());
  for (Index c = 0; c < cameras; ++c) {
    const CalibratedCamera& camera =
        known.camera(model.cameras[static_cast<std::size_t>(c)].camera.name);
    if (camera.covariance.rows() == kFileParameters)
      own.block<kLens, kLens>(kLens * c, kLens * c) =
          camera.covariance.topLeftCorner<kLens, kLens>();
  }
  const MatrixXd map =
      to_file(model, moved, kFileParameters * cameras) * follows.topRows(kFileParameters * cameras);
  covariance += map * own * map.transpose();
}

std::optional<MeasuredPlate> measured_plate(const JointModel& model, const JointFit& fit,
                                            double inflation,
                                            Eigen::Matrix<double, board_parameters, 1>& print) {
  NormalEquations normal(model, fit);
  normal.eliminate_points();
  const JointLayout& layout = normal.layout;
  const Index all = layout.lengths_at, lengths = layout.size - all, values = 3 * layout.points;
  const MatrixXd covariance = inverse_of_information(information_of(model, fit));
  if (covariance.size() == 0) return std::nullopt;
  MatrixXd steps = MatrixXd::Identity(layout.size, all);
  if (lengths > 0)
    steps.bottomRows(lengths) =
        solve_symmetric(MatrixXd(-normal.matrix.bottomRightCorner(lengths, lengths)),
                        MatrixXd(normal.matrix.bottomLeftCorner(lengths, all)));
  MatrixXd follow = normal.points_after(steps, false);
  // Displacements common to all points: those of the board, then rigid motions.
  MatrixXd shapes = MatrixXd::Zero(values, board_parameters + 6);
  for (Index i = 0; i < layout.points; ++i) {
    const Eigen::Vector3d& drawn = model.board.drawn[static_cast<std::size_t>(i)];
    auto own = shapes.middleRows<3>(3 * i);
    own.leftCols<board_parameters>() = model.board.shapes(drawn);
    own.middleCols<3>(board_parameters).setIdentity();
    own.rightCols<3>() = -cross_matrix(drawn / units::mm);
    for (std::size_t k = 0; k < layout.board.size(); ++k)
      follow.block<3, 1>(3 * i, layout.board_at + static_cast<Index>(k)) +=
          own.col(layout.board[k]);
  }
  VectorXd moved_mm(values);
  for (Index i = 0; i < layout.points; ++i) {
    const Eigen::Vector3d& drawn = model.board.drawn[static_cast<std::size_t>(i)];
    moved_mm.segment<3>(3 * i) = (model.board.bent(drawn, static_cast<int>(i)) - drawn) / units::mm;
  }
  const MatrixXd shared =
      solve_symmetric(MatrixXd(shapes.transpose() * shapes), MatrixXd(shapes.transpose()));
  const MatrixXd together = shared * follow, apart = follow - shapes * together;
  MatrixXd common = together * covariance * together.transpose();
  const VectorXd spread = (apart * covariance).cwiseProduct(apart).rowwise().sum();
  MeasuredPlate plate;
  for (Index i = 0; i < layout.points; ++i) {
    const Eigen::Matrix3d own = normal.points.middleCols<3>(3 * i);
    common += shared.middleCols<3>(3 * i) * own * shared.middleCols<3>(3 * i).transpose();
    plate.points_m.push_back(model.board.drawn[static_cast<std::size_t>(i)] +
                             units::mm * moved_mm.segment<3>(3 * i));
    plate.sd_m.emplace_back(units::mm *
                            (inflation * (own.diagonal() + spread.segment<3>(3 * i))).cwiseSqrt());
  }
  plate.common_covariance = inflation * common.topLeftCorner<board_parameters, board_parameters>();
  plate.common_covariance =
      (0.5 * (plate.common_covariance + plate.common_covariance.transpose())).eval();
  if (std::find(layout.board.begin(), layout.board.end(), 4) == layout.board.end()) {
    plate.common_covariance.row(4).setZero();  // the scale is as drawn
    plate.common_covariance.col(4).setZero();
  }
  print = (shared * moved_mm).head<board_parameters>();
  return plate;
}

Eigen::Matrix3d centre_covariance_mm2(const CalibratedCamera& camera) {
  // centre = -R' t; a further rotation w makes it -R' (1 - [w]x) t.
  const CamFromWorld& pose = camera.camera.cam_from_world;
  Eigen::Matrix<double, 3, 6> d;
  d << pose.rotation.transpose() * -cross_matrix(pose.translation_m / units::mm) *
           left_jacobian(rotation_vector(pose.rotation)),
      -pose.rotation.transpose();
  return d * camera.covariance.bottomRightCorner<6, 6>() * d.transpose();
}

}  // namespace drape::calib
