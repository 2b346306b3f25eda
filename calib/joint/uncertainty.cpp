// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/uncertainty.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/camera_model.hpp"
#include "core/geometry/vectors.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {

using Eigen::Index, Eigen::MatrixXd, Eigen::Vector3d, Eigen::VectorXd;

namespace {

/// T with T A T' = 1; empty if A is numerically singular.
MatrixXd whitener_of(const MatrixXd& information) {
  const VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return {};
  const SymmetricEigen eigen =
      symmetric_eigen(scale.asDiagonal() * information * scale.asDiagonal());
  const VectorXd& values = eigen.values;
  if (!(values[0] > 1e-14 * values[values.size() - 1])) return {};
  return values.cwiseSqrt().cwiseInverse().asDiagonal() * eigen.vectors.transpose() *
         scale.asDiagonal();
}

/// Corrects a view's gradient for leverage: for white noise the result has covariance `own`, the
/// gradient at the optimum own - own^2.
VectorXd without_leverage(const MatrixXd& own, const VectorXd& pull) {
  const SymmetricEigen eigen = symmetric_eigen(own);
  VectorXd along = eigen.vectors.transpose() * pull;
  for (Index i = 0; i < along.size(); ++i) {
    // A direction determined by this view alone leaves no residual to test it with.
    const double left = 1 - eigen.values[i];
    along[i] = left > 1e-9 ? along[i] / std::sqrt(left) : 0;
  }
  return eigen.vectors * along;
}

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

/// Covariance (mm^2) of a point measured by all cameras due to the calibration alone, from the
/// joint covariance (first order, equal weights). nullopt if fewer than two cameras see the point
/// or there is no joint covariance.
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

/// Images of the points in one calibration, with derivatives by its parameters and by the points.
struct Images {
  VectorXd px;
  MatrixXd by_parameters, by_world;  ///< px per file unit; by turn (rad), shift (m) of the world
  std::vector<Eigen::Matrix<double, 2, 3>> by_point;  ///< px per m
};

/// Rows are ordered by camera, then point; a point that does not project has zero rows.
Images images_of(const Calibration& calibration, const std::vector<std::string>& names,
                 const std::vector<Vector3d>& points, const MatrixXd& parameters_map) {
  const auto rows = static_cast<Index>(2 * names.size() * points.size());
  Images out{VectorXd::Zero(rows),
             MatrixXd::Zero(rows, parameters_map.rows()),
             MatrixXd::Zero(rows, 6),
             {}};
  Index row = 0, offset = 0;
  for (const std::string& name : names) {
    const Camera& camera = calibration.camera(name).camera;
    const auto width = static_cast<Index>(parameter_names(camera.model).size());
    for (const Vector3d& point : points) {
      const auto image = project(camera.model, camera.cam_from_world * point);
      const auto d = d_px_d_parameters(camera, point);
      out.by_point.emplace_back(Eigen::Matrix<double, 2, 3>::Zero());
      if (image && d) {
        out.px.segment<2>(row) = image->px;
        out.by_parameters.block(row, offset, 2, width) = *d;
        out.by_point.back() = image->d_px_d_point * camera.cam_from_world.rotation;
        for (int axis = 0; axis < 3; ++axis)
          out.by_world.block<2, 1>(row, axis) =
              out.by_point.back() * Vector3d::Unit(axis).cross(point);
        out.by_world.block<2, 3>(row, 3) = out.by_point.back();
      }
      row += 2;
    }
    offset += width;
  }
  return out;
}

/// Covariance of the named cameras' parameters; zero if the calibration states none.
MatrixXd covariance_of(const Calibration& calibration, const std::vector<std::string>& names) {
  std::vector<Index> places;
  Index size = 0;
  for (const std::string& name : names)
    size += static_cast<Index>(parameter_names(calibration.camera(name).camera.model).size());
  MatrixXd covariance = MatrixXd::Zero(size, size);
  Index at = 0;
  for (const std::string& name : names) {
    const CalibratedCamera& camera = calibration.camera(name);
    for (const std::string& parameter : parameter_names(camera.camera.model)) {
      const auto& joint = calibration.joint_covariance_parameters;
      const auto found =
          std::find(joint.begin(), joint.end(), fmt::format("{}/{}", name, parameter));
      places.push_back(found == joint.end() ? -1 : found - joint.begin());
    }
    if (calibration.joint_covariance.size() == 0 && camera.covariance.size() > 0)
      covariance.block(at, at, camera.covariance.rows(), camera.covariance.cols()) =
          camera.covariance;
    at = static_cast<Index>(places.size());
  }
  for (Index i = 0; i < size && calibration.joint_covariance.size() > 0; ++i) {
    for (Index j = 0; j < size; ++j) {
      const Index a = places[static_cast<std::size_t>(i)], b = places[static_cast<std::size_t>(j)];
      if (a >= 0 && b >= 0) covariance(i, j) = calibration.joint_covariance(a, b);
    }
  }
  return covariance;
}

/// Probability of a larger sum of squares, given its covariance (Satterthwaite 1946).
double probability(double sum, const MatrixXd& covariance) {
  const double mean = covariance.trace(), squares = covariance.squaredNorm();
  if (!(mean > 0)) return sum > 0 ? 0 : 1;
  const double dof = mean * mean / squares;
  return chi_square_tail(sum / mean * dof, dof);
}

}  // namespace

ViewScatter scatter_of_views(const JointModel& model, const JointFit& fit, double least_inflation) {
  ViewScatter out;
  const ViewsInformation information = information_by_view(model, fit);
  const std::vector<ViewInformation>& views = information.views;
  if (views.empty()) return out;
  const MatrixXd all = information.sum();
  const MatrixXd whiten = whitener_of(all);
  if (whiten.size() == 0) return out;
  const Index size = all.rows();
  MatrixXd seen = MatrixXd::Zero(size, size), scatter = seen;
  std::vector<MatrixXd> owns, squares;
  double concentration = 0;
  for (const ViewInformation& view : views) {
    MatrixXd own = whiten * view.information * whiten.transpose();
    const VectorXd pull = without_leverage(own, whiten * view.score);
    seen += own;
    squares.push_back(pull * pull.transpose());
    scatter += squares.back();
    concentration += own.squaredNorm();
    owns.push_back(std::move(own));
  }
  // Directions fixed by the placement that defines the world have no residual and get the mean.
  const double directions = seen.trace();
  const double by_direction = std::max(directions / concentration - 1, 1.0);
  out.inflation = std::max(scatter.trace() / directions, least_inflation);
  double noise = 0;
  for (std::size_t i = 0; i < squares.size(); ++i)
    noise += (squares[i] - owns[i].trace() / directions * scatter).squaredNorm();
  const double apart = (scatter - out.inflation * seen).squaredNorm();
  out.shrinkage = apart > 0 ? std::min(1.0, noise / apart) : 1;
  const double own_part = 1 - out.shrinkage;
  const MatrixXd mean = out.inflation * MatrixXd::Identity(size, size);
  MatrixXd whitened =
      out.shrinkage * mean +
      own_part * (scatter + out.inflation * (MatrixXd::Identity(size, size) - seen));
  // A stated error keeps its size, whatever the scatter between views.
  whitened -= (out.inflation - model.noise) * whiten * information.stated * whiten.transpose();
  const SymmetricEigen eigen = symmetric_eigen(whitened);
  whitened = eigen.vectors * eigen.values.cwiseMax(least_inflation).asDiagonal() *
             eigen.vectors.transpose();
  out.degrees_of_freedom = 1 / (std::pow(out.shrinkage, 2) / (by_direction * directions) +
                                std::pow(own_part, 2) / by_direction);
  const double widening =
      student_quantile(0.975, std::max(out.degrees_of_freedom, 2.0)) / normal_quantile(0.975);
  out.covariance = widening * widening * whiten.transpose() * whitened * whiten;
  out.covariance = (0.5 * (out.covariance + out.covariance.transpose())).eval();
  return out;
}

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

Drift drift_between(const Calibration& old, const Calibration& now,
                    const std::vector<Vector3d>& points) {
  Drift drift;
  std::vector<std::string> names;
  for (const CalibratedCamera& camera : now.cameras) {
    const std::string& name = camera.camera.name;
    const bool known = old.find(name) != nullptr;
    (known ? names : drift.not_in_old).push_back(name);
  }
  if (names.empty()) {
    throw bad_input("the two calibrations have no camera in common", {},
                    "compare with an older calibration of the same rig");
  }
  const MatrixXd now_covariance = covariance_of(now, names),
                 old_covariance = covariance_of(old, names);
  const Images seen = images_of(now, names, points, now_covariance);
  // Aligns the old world with the new one by the old and new images of the points.
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Vector3d shift = Vector3d::Zero();
  Images before;
  for (int round = 0; round < 10; ++round) {
    std::vector<Vector3d> in_old;
    in_old.reserve(points.size());
    for (const Vector3d& point : points) in_old.emplace_back(turn * point + shift);
    before = images_of(old, names, in_old, old_covariance);
    const VectorXd step = least_squares(before.by_world, VectorXd(seen.px - before.px));
    turn = rotation_about(step.head<3>()) * turn;
    shift = rotation_about(step.head<3>()) * shift + step.tail<3>();
    if (step.norm() < 1e-12) break;
  }
  const MatrixXd left = least_squares(
      before.by_world, MatrixXd(MatrixXd::Identity(before.px.size(), before.px.size())));
  const MatrixXd apart = MatrixXd::Identity(left.cols(), left.cols()) -
                         before.by_world * left;  // without the alignment
  const VectorXd moved = apart * (before.px - seen.px);
  const MatrixXd from_now = apart * seen.by_parameters, from_old = apart * before.by_parameters;
  const MatrixXd covariance = from_now * now_covariance * from_now.transpose() +
                              from_old * old_covariance * from_old.transpose();
  const auto rows = static_cast<Index>(2 * points.size());
  for (std::size_t c = 0; c < names.size(); ++c) {
    const Index at = rows * static_cast<Index>(c);
    const MatrixXd own = covariance.block(at, at, rows, rows);
    const double sum = moved.segment(at, rows).squaredNorm();
    const auto count = static_cast<double>(points.size());
    drift.cameras.push_back({names[c], std::sqrt(sum / count),
                             std::sqrt(std::max(own.trace(), 0.0) / count), probability(sum, own)});
  }
  if (names.size() < 2) return drift;
  // A measured point follows its images: least squares over the cameras.
  MatrixXd measured = MatrixXd::Zero(static_cast<Index>(3 * points.size()), moved.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    for (std::size_t c = 0; c < names.size(); ++c) {
      const auto& d = seen.by_point[c * points.size() + i];
      information += d.transpose() * d;
    }
    for (std::size_t c = 0; c < names.size(); ++c) {
      const auto& d = seen.by_point[c * points.size() + i];
      measured.block<3, 2>(static_cast<Index>(3 * i),
                           rows * static_cast<Index>(c) + static_cast<Index>(2 * i)) =
          information.ldlt().solve(d.transpose()) / units::mm;
    }
  }
  const auto count = static_cast<double>(points.size());
  drift.moved_mm = (measured * moved).norm() / std::sqrt(count);
  drift.expected_mm =
      std::sqrt(std::max((measured * covariance * measured.transpose()).trace(), 0.0) / count);
  return drift;
}

}  // namespace drape::calib
