// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/changes.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/acceptance/draws.hpp"
#include "core/camera_derivatives.hpp"
#include "core/geometry/dense.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using units::mm;

/// Unknowns besides the poses: errors of the calibration in units of its root; of the plate's size
/// and two bows, in units of their uncertainties if stated; growth of the plate (1), its two bows
/// (mm), and rotation (rad) and shift (mm) of each camera.
struct Unknowns {
  Index calibration = 0, cameras = 0;  ///< `calibration` includes the plate's size and bow
  PlateUncertainty plate;
  [[nodiscard]] Index growth() const { return calibration; }
  [[nodiscard]] Index bow() const { return calibration + 1; }
  [[nodiscard]] Index camera(std::size_t c) const {
    return calibration + 3 + 6 * static_cast<Index>(c);
  }
  [[nodiscard]] Index count() const { return calibration + 3 + 6 * cameras; }
};

/// Information of one position on the unknowns, after elimination of its pose.
struct Evidence {
  MatrixXd information;
  VectorXd score;
  double squares = 0;
  Index rows = 0;
};

constexpr Index kPose = 6;

std::optional<Evidence> evidence_of(const Position& position, const Detections& detections,
                                    const Calibration& calibration, const Plate& plate,
                                    const MatrixXd& root, const Unknowns& unknowns) {
  Index rows = 0;
  for (const FrameDetections& frame : detections.frames)
    if (frame.set == position.set) rows += 2 * static_cast<Index>(frame.detections.size());
  MatrixXd d = MatrixXd::Zero(rows, kPose + unknowns.count());
  VectorXd residuals(rows);
  Index at = 0, parameter = 0;
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    const Camera& camera = calibration.cameras[c].camera;
    const auto own = static_cast<Index>(parameter_names(camera.model).size());
    for (const FrameDetections& frame : detections.frames) {
      if (frame.set != position.set || frame.camera != camera.name) continue;
      for (const Detection& seen : frame.detections) {
        const Vector3d flat = plate.point(seen.mark);
        const Vector3d turned = position.pose.rotation * flat;
        const Vector3d in_world = position.pose * flat;
        const Vector3d in_camera = camera.cam_from_world * in_world;
        const auto image = project(camera.model, in_camera);
        const auto by_parameters = d_px_d_parameters(camera, in_world);
        if (!image || !by_parameters) continue;
        const Eigen::Matrix2d whiten = whitener(seen.covariance_px2);
        const Eigen::Matrix<double, 2, 3> by_camera = whiten * image->d_px_d_point;
        const Eigen::Matrix<double, 2, 3> by_world = by_camera * camera.cam_from_world.rotation;
        auto row = d.middleRows<2>(at);
        row.leftCols<3>() = -by_world * cross_matrix(turned);
        row.middleCols<3>(3) = by_world * mm;
        if (root.cols() > 0)
          row.middleCols(kPose, root.cols()) =
              whiten * *by_parameters * root.middleRows(parameter, own);
        row.col(kPose + unknowns.growth()) = by_world * turned;
        if (unknowns.plate.scale > 0)
          row.col(kPose + root.cols()) = unknowns.plate.scale * by_world * turned;
        const Eigen::Matrix2d by_bow =
            by_world * position.pose.rotation.col(2) * mm *
            plate.bow.shape(plate.target.point_in_target(seen.mark)).transpose();
        row.middleCols<2>(kPose + unknowns.bow()) = by_bow;
        if (unknowns.plate.has_bow())
          row.middleCols<2>(kPose + unknowns.calibration - 2) =
              by_bow * unknowns.plate.bow_mm.asDiagonal();
        row.middleCols<3>(kPose + unknowns.camera(c)) = -by_camera * cross_matrix(in_camera);
        row.middleCols<3>(kPose + unknowns.camera(c) + 3) = by_camera * mm;
        residuals.segment<2>(at) = whiten * (seen.centre_px - image->px);
        at += 2;
      }
    }
    parameter += own;
  }
  if (at <= kPose) return std::nullopt;
  const auto pose = d.topLeftCorner(at, kPose);
  const auto others = d.topRightCorner(at, unknowns.count());
  const auto r = residuals.head(at);
  const Eigen::LDLT<MatrixXd> factor(MatrixXd(pose.transpose() * pose));
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0)) return std::nullopt;
  const MatrixXd coupling = pose.transpose() * others;
  const MatrixXd taken = factor.solve(coupling);
  const VectorXd by_pose = pose.transpose() * r;
  Evidence evidence;
  evidence.information = others.transpose() * others - coupling.transpose() * taken;
  evidence.score = others.transpose() * r - taken.transpose() * by_pose;
  evidence.squares = r.squaredNorm() - by_pose.dot(factor.solve(by_pose));
  evidence.rows = at - kPose;
  return evidence;
}

/// Pseudo-inverse of an information matrix scaled by its diagonal, with the rank.
struct Inverse {
  MatrixXd matrix;
  Index rank = 0;
};
Inverse inverse_of(const MatrixXd& information) {
  const VectorXd by =
      information.diagonal().unaryExpr([](double v) { return v > 1e-30 ? 1 / std::sqrt(v) : 0; });
  const SymmetricEigen eigen = symmetric_eigen(by.asDiagonal() * information * by.asDiagonal());
  Inverse result;
  VectorXd values = eigen.values;
  for (Index i = 0; i < values.size(); ++i) {
    result.rank += values[i] > 1e-9;
    values[i] = values[i] > 1e-9 ? 1 / values[i] : 0;
  }
  result.matrix = by.asDiagonal() * eigen.vectors * values.asDiagonal() *
                  eigen.vectors.transpose() * by.asDiagonal();
  return result;
}

/// Sums over positions, with the detections' variance enlarged.
struct Sum {
  MatrixXd information;
  VectorXd score;
};
Sum sum_of(const std::vector<Evidence>& all, const Unknowns& unknowns, double variance) {
  Sum sum{MatrixXd::Zero(unknowns.count(), unknowns.count()), VectorXd::Zero(unknowns.count())};
  for (const Evidence& one : all) {
    sum.information += one.information / variance;
    sum.score += one.score / variance;
  }
  sum.information.diagonal().head(unknowns.calibration).array() += 1;
  return sum;
}

/// Ratio of the detections' variance to the stated one, from residuals besides all changes, and
/// from the scatter between positions, since errors within one view are correlated.
struct Variance {
  double points = 1, positions = 1;
};
Variance variance_of(const std::vector<Evidence>& all, const Unknowns& unknowns) {
  const Sum sum = sum_of(all, unknowns, 1);
  const Inverse inverse = inverse_of(sum.information);
  const VectorXd found = inverse.matrix * sum.score;
  double squares = 0, rows = 0, scatter = 0, freedom = 0;
  for (const Evidence& one : all) {
    squares += one.squares - 2 * found.dot(one.score) + found.dot(one.information * found);
    rows += static_cast<double>(one.rows);
    const VectorXd left = one.score - one.information * found;
    const Inverse own = inverse_of(one.information);
    scatter += left.dot(own.matrix * left);
    freedom += static_cast<double>(own.rank);
  }
  const auto fitted = static_cast<double>(inverse.rank);
  Variance variance;
  variance.points = std::max(1.0, squares / std::max(rows - fitted, 1.0));
  variance.positions = variance.points;
  if (freedom > 2 * fitted)
    variance.positions = std::max(variance.points, scatter / (freedom - fitted));
  return variance;
}

/// Estimate of one change alone, together with the calibration's error.
struct Found {
  VectorXd estimate;
  MatrixXd information;
  double chi2 = 0;
};
std::optional<Found> found_of(const Sum& sum, const Unknowns& unknowns, Index from, Index count) {
  const Index k = unknowns.calibration;
  Found found;
  found.information = sum.information.block(from, from, count, count);
  VectorXd score = sum.score.segment(from, count);
  if (k > 0) {
    const MatrixXd taken = solve_positive(sum.information.topLeftCorner(k, k),
                                          MatrixXd(sum.information.block(0, from, k, count)));
    found.information -= sum.information.block(from, 0, count, k) * taken;
    score -= taken.transpose() * sum.score.head(k);
  }
  const Inverse inverse = inverse_of(found.information);
  if (inverse.rank < count) return std::nullopt;
  found.estimate = inverse.matrix * score;
  found.chi2 = score.dot(found.estimate);
  return found;
}

/// Excess of chi2 over its limit at which 95 of 100 tests detect a change (normal approximation of
/// the noncentral chi2).
double noncentrality(int dof, double chi2_limit) {
  double lambda = chi2_limit;
  for (int i = 0; i < 50; ++i)
    lambda = std::max(chi2_limit - dof, 0.0) + 1.645 * std::sqrt(2 * (dof + 2 * lambda));
  return lambda;
}

/// Value, U and limit of a change with several components, as the root of chi2 per degree of
/// freedom.
AcceptanceFigure figure_of(const std::string& name, const Found& found, double false_no_go) {
  const auto dof = static_cast<int>(found.estimate.size());
  AcceptanceFigure figure;
  figure.name = name;
  figure.unit = "of the stated uncertainty";
  figure.value = std::sqrt(std::max(found.chi2, 0.0) / dof);
  figure.expanded = std::sqrt(chi2_per_dof_beyond(dof, 1 - kCoverage));
  figure.limit = figure.expanded + std::sqrt(chi2_per_dof_beyond(dof, false_no_go));
  return figure;
}

double smallest_named(const MatrixXd& information, double lambda) {
  const double weakest = symmetric_eigen(information).values.minCoeff();
  return std::sqrt(lambda / std::max(weakest, 1e-30));
}

AcceptanceFigure growth_figure(const Found& found, double false_no_go) {
  AcceptanceFigure figure;
  figure.name = "growth of the plate";
  figure.unit = "%";
  figure.value = 100 * std::abs(found.estimate[0]);
  const double sd = 100 / std::sqrt(found.information(0, 0));
  const Faultless faultless = faultless_of_normal(sd, 1, false_no_go);
  figure.expanded = faultless.expanded;
  figure.limit = faultless.expanded + faultless.largest;
  figure.smallest = faultless.largest + 1.645 * sd;
  figure.smallest_unit = "%";
  figure.where = fmt::format("{:+.4f} %", 100 * found.estimate[0]);
  figure.cause = fmt::format(
      "all lengths on the plate measure {:+.4f} % of what its file says: another print, a plate "
      "that grew, or lenses turned since the calibration; measure the plate, correct its "
      "[known_length], and calibrate again",
      100 * found.estimate[0]);
  return figure;
}

AcceptanceFigure bow_figure(const Found& found, double false_no_go) {
  AcceptanceFigure figure = figure_of("bow of the plate", found, false_no_go);
  const double lambda = noncentrality(2, 2 * chi2_per_dof_beyond(2, false_no_go));
  figure.smallest = smallest_named(found.information, lambda);
  figure.smallest_unit = "mm at the edge";
  figure.where =
      fmt::format("{:+.4f} mm along x, {:+.4f} mm along y", found.estimate[0], found.estimate[1]);
  figure.cause = fmt::format(
      "the plate is bowed: its edges stand {} above its middle, beside the stated bow; mount it on "
      "a flat plate, or state the bow that `drape calib` found and its standard deviation with "
      "--bow-mm and "
      "--bow-sd-mm",
      figure.where);
  return figure;
}

AcceptanceFigure camera_figure(const std::string& camera, const std::string& others,
                               const Found& found, double mean_information, double false_no_go) {
  AcceptanceFigure figure = figure_of("place of " + camera, found, false_no_go);
  const double lambda = noncentrality(6, 6 * chi2_per_dof_beyond(6, false_no_go));
  figure.smallest = smallest_named(found.information.bottomRightCorner<3, 3>(), lambda);
  figure.smallest_unit = "mm shifted";
  figure.where = fmt::format("{:.3f} deg, {:.3f} mm, {:.3f} px in its images",
                             found.estimate.head<3>().norm() / units::deg,
                             found.estimate.tail<3>().norm(), mean_information);
  figure.cause =
      fmt::format("{}{} moved since the calibration: by {}; clamp it and calibrate again", camera,
                  others, figure.where);
  return figure;
}

/// RMS displacement (px) of a camera's image points by its rotation and shift.
double effect_px(const Detections& detections, const Camera& camera,
                 const std::vector<Position>& positions, const Plate& plate, const VectorXd& step) {
  double squares = 0;
  int points = 0;
  for (const Position& position : positions) {
    for (const FrameDetections& frame : detections.frames) {
      if (frame.set != position.set || frame.camera != camera.name) continue;
      for (const Detection& seen : frame.detections) {
        const Vector3d at = camera.cam_from_world * (position.pose * plate.point(seen.mark));
        const auto image = project(camera.model, at);
        if (!image) continue;
        const Vector3d moved = step.tail<3>() * mm + step.head<3>().cross(at);
        squares += (image->d_px_d_point * moved).squaredNorm();
        ++points;
      }
    }
  }
  return points > 0 ? std::sqrt(squares / points) : 0;
}

/// Most likely change for its number of parameters (Akaike 1974), with those nearly as likely
/// (within 10; Burnham and Anderson 2002). `one_camera`: the same text applies to both cameras.
std::string likeliest(std::vector<std::pair<double, std::string>> explanations, bool one_camera) {
  std::stable_sort(explanations.begin(), explanations.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string cause;
  bool camera_said = false;
  for (const auto& [explained, sentence] : explanations) {
    if (explained < explanations.front().first - 10) break;
    const bool camera = sentence.find(" moved since") != std::string::npos;
    if (camera && camera_said && one_camera) continue;
    camera_said = camera_said || camera;
    cause += (cause.empty() ? "" : "; or, which these sets do not tell apart: ") + sentence;
  }
  return cause;
}

}  // namespace

Changes changes_since(const Detections& detections, const Calibration& calibration,
                      const Plate& plate, const std::vector<Position>& positions,
                      const MatrixXd& root, const PlateUncertainty& plate_uncertainty,
                      double false_no_go) {
  const Unknowns unknowns{
      root.cols() + (plate_uncertainty.scale > 0) + 2 * plate_uncertainty.has_bow(),
      static_cast<Index>(calibration.cameras.size()), plate_uncertainty};
  std::vector<Evidence> all;
  for (const Position& position : positions) {
    auto evidence = evidence_of(position, detections, calibration, plate, root, unknowns);
    if (!evidence) continue;
    all.push_back(std::move(*evidence));
  }
  Changes changes;
  if (all.empty()) return changes;
  const Variance variance = variance_of(all, unknowns);
  changes.noise_variance = variance.points;
  const Sum sum = sum_of(all, unknowns, variance.positions);
  std::vector<std::pair<double, std::string>> explanations;
  const auto consider = [&](AcceptanceFigure figure, const Found& found) {
    if (!figure.good())
      explanations.emplace_back(found.chi2 - 2 * static_cast<double>(found.estimate.size()),
                                figure.cause);
    changes.figures.push_back(std::move(figure));
  };
  if (const auto found = found_of(sum, unknowns, unknowns.growth(), 1))
    consider(growth_figure(*found, false_no_go), *found);
  if (const auto found = found_of(sum, unknowns, unknowns.bow(), 2))
    consider(bow_figure(*found, false_no_go), *found);
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    const auto found = found_of(sum, unknowns, unknowns.camera(c), 6);
    if (!found) continue;
    const Camera& camera = calibration.cameras[c].camera;
    // With only two cameras it is impossible to tell which one moved.
    const std::string others = calibration.cameras.size() == 2
                                   ? " or " + calibration.cameras[1 - c].camera.name
                                   : std::string();
    consider(camera_figure(camera.name, others, *found,
                           effect_px(detections, camera, positions, plate, found->estimate),
                           false_no_go),
             *found);
  }
  changes.cause = likeliest(std::move(explanations), calibration.cameras.size() == 2);
  return changes;
}

}  // namespace drape::calib
