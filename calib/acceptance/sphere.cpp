// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/acceptance/figures.hpp"
#include "core/dot_image.hpp"
#include "core/geometry/dense.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using units::mm;

constexpr std::size_t kLeastOfSphere = 12;

struct Ball {
  Vector3d centre_mm;
  double radius_mm = 0;
};

/// Least squares of the distances from the sphere, from the algebraic fit on.
std::optional<Ball> ball_through(const std::map<MarkId, MeasuredPoint>& points) {
  const auto count = static_cast<Index>(points.size());
  MatrixXd a(count, 4);
  VectorXd b(count);
  Vector3d middle = Vector3d::Zero();
  for (const auto& [mark, point] : points) middle += point.in_world_mm / static_cast<double>(count);
  Index i = 0;
  for (const auto& [mark, point] : points) {
    const Vector3d at = point.in_world_mm - middle;
    a.row(i) << 2 * at.transpose(), 1;
    b[i++] = at.squaredNorm();
  }
  const Eigen::ColPivHouseholderQR<MatrixXd> factor(a);
  if (factor.rank() < 4) return std::nullopt;
  const VectorXd algebraic = factor.solve(b);
  Ball ball{algebraic.head<3>() + middle,
            std::sqrt(std::max(algebraic[3] + algebraic.head<3>().squaredNorm(), 0.0))};
  for (int round = 0; round < 30; ++round) {
    i = 0;
    for (const auto& [mark, point] : points) {
      const Vector3d from = point.in_world_mm - ball.centre_mm;
      a.row(i) << from.normalized().transpose(), 1;
      b[i++] = from.norm() - ball.radius_mm;
    }
    const VectorXd step = least_squares(a, b);
    ball.centre_mm += step.head<3>();
    ball.radius_mm += step[3];
    if (step.norm() < 1e-9) break;
  }
  if (!ball.centre_mm.allFinite() || !(ball.radius_mm > 0)) return std::nullopt;
  return ball;
}

/// Centroids moved to the images of the dots' centres, the dots lying on the ball.
Detections without_eccentricity(Detections marks, const Calibration& calibration,
                                const std::string& set,
                                const std::map<MarkId, MeasuredPoint>& points, const Ball& ball) {
  for (FrameDetections& frame : marks.frames) {
    const auto own = std::find_if(
        calibration.cameras.begin(), calibration.cameras.end(),
        [&](const CalibratedCamera& camera) { return camera.camera.name == frame.camera; });
    if (frame.set != set || own == calibration.cameras.end()) continue;
    const CamFromWorld& pose = own->camera.cam_from_world;
    for (Detection& d : frame.detections) {
      const auto point = points.find(d.mark);
      if (point == points.end()) continue;
      const Vector3d outward =
          pose.rotation * (point->second.in_world_mm - ball.centre_mm).normalized();
      DotInCamera dot;
      dot.centre = pose * (point->second.in_world_mm * mm);
      dot.axis_u = outward.unitOrthogonal();
      dot.axis_v = outward.cross(dot.axis_u);
      dot.radius_m = marks.lattice.dot_diameter_m / 2;
      dot.curvature_per_m = Eigen::Matrix2d::Identity() / (ball.radius_mm * mm);
      const auto image = project(own->camera.model, dot.centre);
      const auto centroid = dot_centroid_px(own->camera.model, dot);
      if (image && centroid) d.centre_px -= *centroid - image->px;
    }
  }
  return marks;
}

}  // namespace

std::vector<AcceptanceFigure> sphere_figures(const AcceptanceInput& input,
                                             const Calibration& calibration,
                                             const FigureContext& context,
                                             const AcceptanceOptions& options) {
  AcceptanceFigure form, size;
  form.name = "form of the sphere";
  size.name = "diameter of the sphere";
  form.unit = size.unit = "mm";
  form.may_lack = size.may_lack = true;
  form.not_measured = size.not_measured =
      "record a ball of known diameter that carries the print, and give its marks with --sphere";
  if (!input.sphere) return {form, size};
  std::vector<double> ranges(static_cast<std::size_t>(context.draws->count()), 0), sizes = ranges;
  const RowVectorXd reference =
      input.sphere->standard_uncertainty_mm * context.draws->standard_normal(1) +
      input.sphere->diameter_mm * context.scale_uncertainty * context.draws->standard_normal(0);
  unsigned seed = 200;
  for (const std::string& set : sets_of(input.sphere->marks)) {
    ++seed;
    auto points = measured_points(input.sphere->marks, calibration, set);
    if (points.size() < kLeastOfSphere) continue;
    auto ball = ball_through(points);
    if (ball && input.sphere->marks.lattice.dot_diameter_m > 0) {
      points = measured_points(
          without_eccentricity(input.sphere->marks, calibration, set, points, *ball), calibration,
          set);
      ball = ball_through(points);
    }
    if (!ball) continue;
    const auto count = static_cast<Index>(points.size());
    MatrixXd shapes(count, 4);
    std::vector<const MeasuredPoint*> list;
    VectorXd radial(count);
    Index i = 0;
    for (const auto& [mark, point] : points) {
      const Vector3d from = point.in_world_mm - ball->centre_mm;
      radial[i] = from.norm() - ball->radius_mm;
      shapes.row(i++) << from.normalized().transpose(), 1;
      list.push_back(&point);
    }
    const double range = radial.maxCoeff() - radial.minCoeff();
    const double off = std::abs(2 * ball->radius_mm - input.sphere->diameter_mm);
    if (form.where.empty() || range > form.value) {
      form.value = range;
      form.where = fmt::format("set {}, {} marks", set, count);
    }
    if (size.where.empty() || off > size.value) {
      size.value = off;
      size.where = fmt::format("set {}, {:.3f} mm measured of {:.3f}", set, 2 * ball->radius_mm,
                               input.sphere->diameter_mm);
    }
    const MatrixXd errors = context.draws->errors_mm(list, context.noise_variance, seed);
    MatrixXd along(count, errors.cols());
    for (Index k = 0; k < count; ++k)
      along.row(k) = shapes.row(k).head<3>() * errors.middleRows<3>(3 * k);
    const MatrixXd fitted = least_squares(shapes, along);
    const MatrixXd left = along - shapes * fitted;
    for (Index k = 0; k < errors.cols(); ++k) {
      const auto at = static_cast<std::size_t>(k);
      ranges[at] = std::max(ranges[at], left.col(k).maxCoeff() - left.col(k).minCoeff());
      sizes[at] = std::max(sizes[at], std::abs(2 * fitted(3, k) - reference[k]));
    }
  }
  if (form.where.empty()) {
    form.not_measured = size.not_measured = fmt::format(
        "no set shows {} marks of the ball to two cameras: record more of it", kLeastOfSphere);
    form.may_lack = size.may_lack = false;
    return {form, size};
  }
  form.not_measured = size.not_measured = "";
  set_limit(form, faultless_of(std::move(ranges), context.false_no_go), options.max_sphere_form_mm);
  set_limit(size, faultless_of(std::move(sizes), context.false_no_go), options.max_sphere_size_mm);
  return {form, size};
}

}  // namespace drape::calib
