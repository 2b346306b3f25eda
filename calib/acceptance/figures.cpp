// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/figures.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>

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

constexpr std::size_t kLeastOfPlane = 12;  ///< least number of points for flatness

std::vector<const MeasuredPoint*> all_of(const std::map<MarkId, MeasuredPoint>& points) {
  std::vector<const MeasuredPoint*> list;
  list.reserve(points.size());
  for (const auto& [mark, point] : points) list.push_back(&point);
  return list;
}

/// Running maximum of absolute errors, for each draw.
struct Largest {
  RowVectorXd of_draws;
  void take(const RowVectorXd& errors) {
    of_draws = of_draws.size() == 0 ? errors : RowVectorXd(of_draws.cwiseMax(errors));
  }
  [[nodiscard]] Faultless faultless(double false_no_go) const {
    return faultless_of({of_draws.begin(), of_draws.end()}, false_no_go);
  }
};

void keep_worst(AcceptanceFigure& figure, double value, const std::string& where) {
  if (!figure.where.empty() && value <= figure.value) return;
  figure.value = value;
  figure.where = where;
}

/// Projects errors along each point's direction (rows) onto the complement of `shapes`.
MatrixXd beside(const MatrixXd& along, const MatrixXd& shapes) {
  return along - shapes * least_squares(shapes, along);
}

/// Components of `errors` (three rows per point) along each point's own direction (3 x n).
MatrixXd part_along(const MatrixXd& errors, const MatrixXd& directions) {
  MatrixXd along(directions.cols(), errors.cols());
  for (Index i = 0; i < directions.cols(); ++i)
    along.row(i) = directions.col(i).transpose() * errors.middleRows<3>(3 * i);
  return along;
}

RowVectorXd range_of(const MatrixXd& columns) {
  return columns.colwise().maxCoeff() - columns.colwise().minCoeff();
}

AcceptanceFigure figure_named(const std::string& name, const std::string& unit) {
  AcceptanceFigure figure;
  figure.name = name;
  figure.unit = unit;
  return figure;
}

constexpr std::size_t kLeastOfSphere = 12;

struct Ball {
  Vector3d centre_mm;
  double radius_mm = 0;
};

/// Least-squares sphere through the points, started from the algebraic fit.
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

/// Shifts centroids to the images of the dots' centres, for dots on the surface of the ball.
Detections without_eccentricity(Detections marks, const Calibration& calibration,
                                const std::string& set,
                                const std::map<MarkId, MeasuredPoint>& points, const Ball& ball) {
  for (FrameDetections& frame : marks.frames) {
    const CalibratedCamera* own = calibration.find(frame.camera);
    if (frame.set != set || own == nullptr) continue;
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
      if (const auto off = eccentricity_px(own->camera.model, dot)) d.centre_px -= *off;
    }
  }
  return marks;
}

/// Sets U and limit from the distribution of faultless instruments.
void set_limit(AcceptanceFigure& figure, const Faultless& faultless,
               const std::optional<double>& stated) {
  figure.expanded = faultless.expanded;
  figure.limit_stated = stated.has_value();
  figure.limit = stated.value_or(faultless.expanded + faultless.largest);
  if (!figure.smallest_unit.empty()) return;
  figure.smallest = figure.limit;
  figure.smallest_unit = figure.unit;
}

}  // namespace

std::vector<std::pair<MarkId, MarkId>> lengths_of(const Target& target) {
  const int row = target.rows - 1, col = target.cols - 1;
  return {{{0, 0}, {row, col}},
          {{0, col}, {row, 0}},
          {{0, 0}, {0, col}},
          {{0, 0}, {row, 0}},
          {{0, 0}, {row / 2, col / 2}}};
}

AcceptanceFigure length_error(const std::vector<Position>& positions, const Plate& plate,
                              const FigureContext& context, const AcceptanceOptions& options) {
  AcceptanceFigure figure = figure_named("length error", "mm");
  Largest largest;
  std::vector<const Position*> whole;
  unsigned seed = 0;
  const RowVectorXd scale = context.scale_uncertainty * context.draws->standard_normal(0);
  for (const Position& position : positions) {
    ++seed;
    const auto pairs = lengths_of(plate.target);
    std::vector<const MeasuredPoint*> ends;
    std::vector<double> true_mm;
    for (const auto& [from, to] : pairs) {
      const auto a = position.points.find(from), b = position.points.find(to);
      if (a == position.points.end() || b == position.points.end()) continue;
      ends.push_back(&a->second);
      ends.push_back(&b->second);
      true_mm.push_back((plate.point(to) - plate.point(from)).norm() / mm);
      const double length = (b->second.in_world_mm - a->second.in_world_mm).norm();
      keep_worst(figure, std::abs(length - true_mm.back()),
                 fmt::format("set {}, ({}, {}) to ({}, {}), {:.2f} mm", position.set, from.row,
                             from.col, to.row, to.col, true_mm.back()));
    }
    if (true_mm.size() == pairs.size()) whole.push_back(&position);
    if (ends.empty()) continue;
    // A corner shared by several lengths has the same error in each.
    std::vector<const MeasuredPoint*> corners = ends;
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    std::sort(corners.begin(), corners.end(), [](const auto* a, const auto* b) {
      return std::lexicographical_compare(a->in_world_mm.begin(), a->in_world_mm.end(),
                                          b->in_world_mm.begin(), b->in_world_mm.end());
    });
    const MatrixXd errors = context.draws->errors_mm(corners, context.noise_variance, seed);
    const auto rows_of = [&](const MeasuredPoint* point) {
      const auto at = std::find(corners.begin(), corners.end(), point) - corners.begin();
      return errors.middleRows<3>(3 * static_cast<Index>(at));
    };
    for (std::size_t k = 0; k < true_mm.size(); ++k) {
      const MeasuredPoint *a = ends[2 * k], *b = ends[2 * k + 1];
      const Vector3d along = (b->in_world_mm - a->in_world_mm).normalized();
      const RowVectorXd error = along.transpose() * (rows_of(b) - rows_of(a)) - true_mm[k] * scale;
      largest.take(error.cwiseAbs());
    }
  }
  const int places = count_places(whole, plate);
  if (places < options.least_positions) {
    figure.not_measured = fmt::format(
        "{} all five lengths to two cameras{}, {} are needed: record the whole target in more "
        "places of the drape volume",
        places == 1 ? "1 position shows" : fmt::format("{} positions show", places),
        static_cast<int>(whole.size()) > places
            ? fmt::format(" ({} sets, but those of one place are one position)", whole.size())
            : "",
        options.least_positions);
    return figure;
  }
  set_limit(figure, largest.faultless(context.false_no_go), options.max_length_error_mm);
  return figure;
}

AcceptanceFigure flatness(const std::vector<Position>& positions, const Plate& plate,
                          const FigureContext& context, const AcceptanceOptions& options) {
  AcceptanceFigure figure = figure_named("flatness of the plate", "mm");
  Largest largest;
  unsigned seed = 100;
  Eigen::Matrix2Xd bow(2, context.draws->count());
  for (const Index axis : {0, 1})
    bow.row(axis) =
        options.bow_sd_mm[axis] * context.draws->standard_normal(3 + static_cast<unsigned>(axis));
  for (const Position& position : positions) {
    ++seed;
    if (position.points.size() < kLeastOfPlane) continue;
    const Vector3d normal = position.pose.rotation.col(2);
    const auto points = all_of(position.points);
    const auto count = static_cast<Index>(points.size());
    MatrixXd shapes(count, 3);
    VectorXd heights(count);
    Index i = 0;
    for (const auto& [mark, point] : position.points) {
      const Vector3d flat = plate.target.point_in_target(mark) / mm;
      shapes.row(i) << 1, flat.x(), flat.y();
      heights[i++] = normal.dot(point.in_world_mm - position.pose * plate.point(mark) / mm);
    }
    keep_worst(figure, range_of(beside(heights, shapes)).value(), "set " + position.set);
    const MatrixXd errors = context.draws->errors_mm(points, context.noise_variance, seed);
    MatrixXd along = part_along(errors, normal.replicate(1, count));
    i = 0;
    for (const auto& [mark, point] : position.points)
      along.row(i++) += plate.bow.shape(plate.target.point_in_target(mark)).transpose() * bow;
    largest.take(range_of(beside(along, shapes)));
  }
  if (figure.where.empty()) {
    figure.not_measured = fmt::format(
        "no position shows {} points to two cameras: record the "
        "whole target",
        kLeastOfPlane);
    return figure;
  }
  set_limit(figure, largest.faultless(context.false_no_go), options.max_flatness_mm);
  return figure;
}

AcceptanceFigure shift_error(const std::vector<Position>& positions, const Rig& rig,
                             const FigureContext& context, const AcceptanceOptions& options) {
  AcceptanceFigure figure = figure_named("known shift", "mm");
  figure.may_lack = true;
  const auto position_of = [&](const std::string& set) {
    return std::find_if(positions.begin(), positions.end(),
                        [&](const Position& position) { return position.set == set; });
  };
  const auto first = rig.stages.empty() ? positions.end() : position_of(rig.stages.front().set);
  double worst_sd = 0;
  int shifts = 0;
  for (const TargetStage& stage : rig.stages) {
    const auto here = position_of(stage.set);
    if (here == positions.end() || first == positions.end() || here == first) continue;
    std::vector<std::pair<const MeasuredPoint*, const MeasuredPoint*>> common;
    Vector3d shift = Vector3d::Zero();
    for (const auto& [mark, point] : here->points) {
      const auto before = first->points.find(mark);
      if (before == first->points.end()) continue;
      common.emplace_back(&before->second, &point);
      shift += point.in_world_mm - before->second.in_world_mm;
    }
    if (common.empty()) continue;
    const auto count = static_cast<double>(common.size());
    shift /= count;
    const Vector3d weight = shift.normalized() / count;
    double variance = 2 * std::pow(options.shift_uncertainty_mm, 2);
    RowVectorXd by = RowVectorXd::Zero(context.draws->root().rows());
    for (const auto& [before, after] : common) {
      variance +=
          context.noise_variance * weight.dot((before->noise_mm2 + after->noise_mm2) * weight);
      if (by.size() > 0)
        by += weight.transpose() * (after->by_calibration_mm - before->by_calibration_mm);
    }
    variance += (by * context.draws->root()).squaredNorm();
    worst_sd = std::max(worst_sd, std::sqrt(variance));
    ++shifts;
    const double true_mm = std::abs(stage.z_m - rig.stages.front().z_m) / mm;
    keep_worst(figure, std::abs(shift.norm() - true_mm),
               fmt::format("set {}, {:.3f} mm", stage.set, true_mm));
  }
  if (shifts == 0) {
    figure.not_measured = "no two z stages among the sets: record the target at two known heights";
    return figure;
  }
  set_limit(figure, faultless_of_normal(worst_sd, shifts, context.false_no_go),
            options.max_shift_error_mm);
  return figure;
}

std::vector<AcceptanceFigure> sphere_figures(const AcceptanceInput& input,
                                             const Calibration& calibration,
                                             const FigureContext& context,
                                             const AcceptanceOptions& options) {
  AcceptanceFigure form = figure_named("form of the sphere", "mm"),
                   size = figure_named("diameter of the sphere", "mm");
  form.may_lack = size.may_lack = true;
  form.not_measured = size.not_measured =
      "record a ball of known diameter that carries the print, and give its marks with --sphere";
  if (!input.sphere) return {form, size};
  Largest ranges, sizes;
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
    MatrixXd shapes = MatrixXd::Ones(count, 4);
    VectorXd radial(count);
    Index i = 0;
    for (const auto& [mark, point] : points) {
      const Vector3d from = point.in_world_mm - ball->centre_mm;
      radial[i] = from.norm() - ball->radius_mm;
      shapes.row(i++).head<3>() = from.normalized();
    }
    keep_worst(form, range_of(radial).value(), fmt::format("set {}, {} marks", set, count));
    keep_worst(size, std::abs(2 * ball->radius_mm - input.sphere->diameter_mm),
               fmt::format("set {}, {:.3f} mm measured of {:.3f}", set, 2 * ball->radius_mm,
                           input.sphere->diameter_mm));
    const MatrixXd along =
        part_along(context.draws->errors_mm(all_of(points), context.noise_variance, seed),
                   shapes.leftCols<3>().transpose());
    const MatrixXd fitted = least_squares(shapes, along);
    ranges.take(range_of(along - shapes * fitted));
    sizes.take((2 * fitted.row(3) - reference).cwiseAbs());
  }
  if (form.where.empty()) {
    form.not_measured = size.not_measured = fmt::format(
        "no set shows {} marks of the ball to two cameras: record more of it", kLeastOfSphere);
    form.may_lack = size.may_lack = false;
    return {form, size};
  }
  form.not_measured = size.not_measured = "";
  set_limit(form, ranges.faultless(context.false_no_go), options.max_sphere_form_mm);
  set_limit(size, sizes.faultless(context.false_no_go), options.max_sphere_size_mm);
  return {form, size};
}

AcceptanceFigure noise_floor(const Detections& detections, const std::vector<std::string>& repeats,
                             const AcceptanceOptions& options) {
  AcceptanceFigure figure = figure_named("noise of repeats", "of the stated");
  std::map<std::pair<std::string, MarkId>, std::vector<const Detection*>> seen;
  for (const FrameDetections& frame : detections.frames) {
    if (std::find(repeats.begin(), repeats.end(), frame.set) == repeats.end()) continue;
    for (const Detection& d : frame.detections) seen[{frame.camera, d.mark}].push_back(&d);
  }
  double squares = 0;
  int freedom = 0;
  for (const auto& [place, found] : seen) {
    if (found.size() < 2) continue;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Detection* d : found) mean += d->centre_px / static_cast<double>(found.size());
    for (const Detection* d : found)
      squares += (d->centre_px - mean).squaredNorm() / d->covariance_px2.trace() * 2;
    freedom += 2 * (static_cast<int>(found.size()) - 1);
  }
  if (freedom < 20) {
    figure.not_measured =
        "give two or more sets of the target at rest with --repeats to measure the noise floor";
    return figure;
  }
  figure.value = std::sqrt(squares / freedom);
  figure.expanded = figure.value * std::sqrt(2.0 / freedom);  // two standard deviations
  figure.where = fmt::format("{} sets, {} degrees of freedom", repeats.size(), freedom);
  figure.limit = options.max_noise_ratio;
  figure.limit_stated = true;
  figure.smallest = figure.limit;
  figure.smallest_unit = figure.unit;
  return figure;
}

}  // namespace drape::calib
