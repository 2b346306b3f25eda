// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/drift.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/joint/model.hpp"
#include "core/camera_derivatives.hpp"
#include "core/error.hpp"
#include "core/geometry/dense.hpp"
#include "core/geometry/vectors.hpp"
#include "core/statistics/distributions.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

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
  // Aligns the old world with the new one, so that old and new cameras see the points alike.
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
