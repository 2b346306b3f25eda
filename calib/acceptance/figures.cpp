// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/figures.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/camera_model.hpp"
#include "core/files/files.hpp"
#include "core/geometry/next_pose.hpp"
#include "core/geometry/point.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/geometry/vectors.hpp"
#include "core/program/run_record.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {

namespace fs = std::filesystem;
using Eigen::Index, Eigen::Matrix3Xd, Eigen::Matrix3d, Eigen::MatrixXd, Eigen::RowVectorXd,
    Eigen::Vector2d, Eigen::Vector3d, Eigen::VectorXd;
using units::mm;

namespace {

/// Mean distance (m) between common points; nullopt if there are none.
std::optional<double> mean_shift_m(const Position& a, const Position& b) {
  double sum_mm = 0;
  int common = 0;
  for (const auto& [mark, point] : a.points) {
    const auto same = b.points.find(mark);
    if (same == b.points.end()) continue;
    sum_mm += (point.in_world_mm - same->second.in_world_mm).norm();
    ++common;
  }
  if (common == 0) return std::nullopt;
  return sum_mm * units::mm / common;
}

struct Seen {
  const Camera* camera = nullptr;
  Index parameters_at = 0;
  const Detection* detection = nullptr;
};

std::optional<MeasuredPoint> point_from(const std::vector<Seen>& views, Index parameters) {
  constexpr double kLeastAngle = 2 * units::deg;
  std::vector<PixelView> pixels;
  for (const Seen& view : views)
    pixels.push_back({view.camera, view.detection->centre_px, view.detection->covariance_px2});
  const PointFit fit = fit_point(pixels, kLeastAngle);
  if (fit.status != PointStatus::good) return std::nullopt;
  MeasuredPoint point{
      fit.in_world / units::mm,
      fit.by_pixels * fit.covariance_px2 * fit.by_pixels.transpose() / (units::mm * units::mm),
      Eigen::Matrix3Xd::Zero(3, parameters)};
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto by_parameters = d_px_d_parameters(*views[i].camera, fit.in_world);
    if (!by_parameters) return std::nullopt;
    point.by_calibration_mm.middleCols(views[i].parameters_at, by_parameters->cols()) =
        -fit.by_pixels.middleCols<2>(2 * static_cast<Index>(i)) * *by_parameters / units::mm;
  }
  return point;
}

/// True if a file holds detections; an unreadable file does not.
bool is_detections(const fs::path& file) {
  try {
    require_format(Document::read(file), format_of<Detections>);
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// Fraction of faultless instruments within U (k = 2 of a normal distribution).
constexpr double kCoverage = 0.9545;

/// Distribution of a figure over faultless instruments.
struct Faultless {
  double expanded = 0;  ///< U: a fraction of kCoverage stays within
  double largest = 0;   ///< exceeded with probability `false_no_go` only
};

MatrixXd normals(Index rows, Index columns, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

/// Root of the covariance scaled to a unit diagonal, so that rad and px have equal weight.
MatrixXd root_of(const MatrixXd& covariance) {
  if (covariance.size() == 0) return {};
  const Eigen::VectorXd sd = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd by = sd.unaryExpr([](double s) { return s > 0 ? 1 / s : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(by.asDiagonal() * covariance * by.asDiagonal());
  const double floor = 1e-12 * std::max(eigen.values.maxCoeff(), 0.0);
  const Index kept = (eigen.values.array() > floor).count();
  return sd.asDiagonal() * eigen.vectors.rightCols(kept) *
         eigen.values.tail(kept).cwiseSqrt().asDiagonal();
}

/// For draws of a figure that is the largest of several errors: the extreme from a Gumbel
/// distribution with the mean and standard deviation of the draws (Gumbel 1958).
Faultless faultless_of(std::vector<double> draws, double false_no_go) {
  const auto n = static_cast<double>(draws.size());
  const double scale = std::sqrt(6 * squares_about_mean(draws) / n) / std::numbers::pi;
  const auto place = static_cast<std::size_t>(std::min(kCoverage * n, n - 1));
  const double mode = mean_of(draws) - std::numbers::egamma * scale;
  const double covered = order_statistic(std::move(draws), place);
  return {covered, std::max(covered, mode - scale * std::log(-std::log1p(-false_no_go)))};
}

/// The value of chi2 / dof that is exceeded with probability `p`.
double chi2_per_dof_beyond(int dof, double p) {
  return chi_square_beyond(p, dof) / dof;
}

/// For the largest of `count` normal errors with this standard deviation (Sidak 1967).
Faultless faultless_of_normal(double sd, int count, double false_no_go) {
  const auto beyond = [&](double p) {
    return sd * std::sqrt(chi2_per_dof_beyond(1, -std::expm1(std::log1p(-p) / count)));
  };
  return {beyond(1 - kCoverage), beyond(false_no_go)};
}

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
  return Evidence{others.transpose() * others - coupling.transpose() * taken,
                  others.transpose() * r - taken.transpose() * by_pose,
                  r.squaredNorm() - by_pose.dot(factor.solve(by_pose)), at - kPose};
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
  const VectorXd values = eigen.values.unaryExpr([](double v) { return v > 1e-9 ? 1 / v : 0; });
  return {by.asDiagonal() * eigen.vectors * values.asDiagonal() * eigen.vectors.transpose() *
              by.asDiagonal(),
          (values.array() > 0).count()};
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

/// Ratio of the detections' variance to the stated one: from residuals after all changes, and from
/// the scatter between positions, since errors within one view are correlated.
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
  const double points = std::max(1.0, squares / std::max(rows - fitted, 1.0));
  const bool enough = freedom > 2 * fitted;
  return {points, enough ? std::max(points, scatter / (freedom - fitted)) : points};
}

/// Estimate of a single candidate change, with the calibration errors eliminated (Schur
/// complement).
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
  AcceptanceFigure figure{.name = name, .unit = "of the stated uncertainty"};
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
  AcceptanceFigure figure{.name = "growth of the plate", .unit = "%"};
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

/// Projects errors along the points' directions (rows) onto the orthogonal complement of `shapes`.
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
      const Vector3d u = outward.unitOrthogonal();
      const DotInCamera dot{pose * (point->second.in_world_mm * mm), u, outward.cross(u),
                            marks.lattice.dot_diameter_m / 2,
                            Eigen::Matrix2d::Identity() / (ball.radius_mm * mm)};
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

std::map<MarkId, MeasuredPoint> measured_points(const Detections& detections,
                                                const Calibration& calibration,
                                                const std::string& set) {
  std::map<MarkId, std::vector<Seen>> views;
  Index at = 0;
  for (const CalibratedCamera& camera : calibration.cameras) {
    for (const FrameDetections& frame : detections.frames) {
      if (frame.set != set || frame.camera != camera.camera.name) continue;
      for (const Detection& d : frame.detections) views[d.mark].push_back({&camera.camera, at, &d});
    }
    at += static_cast<Index>(parameter_names(camera.camera.model).size());
  }
  std::map<MarkId, MeasuredPoint> points;
  for (const auto& [mark, seen] : views) {
    if (seen.size() < 2) continue;
    if (auto point = point_from(seen, at)) points.emplace(mark, std::move(*point));
  }
  return points;
}

Plate::Plate(Target described, const Vector2d& bow_mm) : target(std::move(described)) {
  Vector2d half = Vector2d::Constant(1e-9), squares = Vector2d::Zero();
  for (const Vector3d& point : points_of(target)) {
    half = half.cwiseMax(point.head<2>().cwiseAbs());
    squares += point.head<2>().cwiseAbs2();
  }
  bow.half_m = half;
  bow.mean = squares.cwiseQuotient(half.cwiseAbs2()) / (target.rows * target.cols);
  bow.edge_rise_mm = bow_mm;
}

std::vector<std::string> sets_of(const Detections& detections) {
  std::vector<std::string> sets;
  for (const FrameDetections& frame : detections.frames) {
    if (std::find(sets.begin(), sets.end(), frame.set) == sets.end()) sets.push_back(frame.set);
  }
  return sets;
}

std::vector<Position> positions_of(const Detections& detections, const Calibration& calibration,
                                   const Plate& plate) {
  std::vector<Position> positions;
  for (const std::string& set : sets_of(detections)) {
    Position position{set, measured_points(detections, calibration, set), {}};
    const auto count = static_cast<Eigen::Index>(position.points.size());
    if (count < 4) continue;
    Matrix3Xd flat(3, count), seen(3, count);
    Eigen::Index i = 0;
    for (const auto& [mark, point] : position.points) {
      flat.col(i) = plate.point(mark);
      seen.col(i++) = point.in_world_mm * mm;
    }
    const auto pose = pose_from_points<frame::World, frame::Target>(flat, seen);
    if (!pose) continue;
    position.pose = *pose;
    positions.push_back(std::move(position));
  }
  return positions;
}

int count_places(const std::vector<const Position*>& positions, const Plate& plate) {
  std::vector<const Position*> places;
  for (const Position* position : positions) {
    const bool again = std::any_of(places.begin(), places.end(), [&](const Position* earlier) {
      const auto shift = mean_shift_m(*earlier, *position);
      return shift && *shift < plate.target.pitch_m / 2;
    });
    if (!again) places.push_back(position);
  }
  return static_cast<int>(places.size());
}

Detections without_eccentricity(Detections detections, const Calibration& calibration,
                                const Plate& plate, const std::vector<Position>& positions) {
  const double radius_m = plate.target.dot_diameter_m / 2;
  if (!(radius_m > 0)) return detections;
  for (FrameDetections& frame : detections.frames) {
    const auto position = std::ranges::find(positions, frame.set, &Position::set);
    const CalibratedCamera* own = calibration.find(frame.camera);
    if (position == positions.end() || own == nullptr) continue;
    const CamFromTarget pose = own->camera.cam_from_world * position->pose;
    for (Detection& d : frame.detections) {
      if (const auto off = eccentricity_px(
              own->camera.model,
              {pose * plate.point(d.mark), pose.rotation.col(0), pose.rotation.col(1), radius_m}))
        d.centre_px -= *off;
    }
  }
  return detections;
}

CalibrationEvidence detections_behind(const fs::path& calibration, const fs::path& tested) {
  const fs::path file = run_record_path(calibration);
  const std::string name = calibration.filename().string();
  CalibrationEvidence evidence;
  if (!fs::is_regular_file(file)) {
    evidence.missing = fmt::format("there is no {} beside {}", file.filename().string(), name);
    return evidence;
  }
  const RunFile record = read_run_file(file);
  if (!record.wrote(sha256_of_file(calibration))) {
    evidence.missing =
        fmt::format("{} is the record of another file than {}", file.filename().string(), name);
    return evidence;
  }
  evidence.missing = fmt::format("{} names no detections", file.filename().string());
  const std::string tested_now = sha256_of_file(tested);
  for (const RecordedFile& input : record.inputs) {
    const std::string& recorded = input.sha256;
    // A file that was moved or replaced is still recognised by its hash.
    const fs::path named = recorded == tested_now ? tested : place_of(file, input);
    if (!fs::is_regular_file(named)) {
      if (named.extension() == ".json")
        evidence.missing = fmt::format("{}, from which {} was made, is not there",
                                       named.lexically_normal().string(), name);
      continue;
    }
    if (!is_detections(named)) continue;
    if (recorded == tested_now || sha256_of_file(named) == recorded)
      return {read_detections(named), named.lexically_normal().string(), ""};
    evidence.missing = fmt::format("{}, from which {} was made, has another content now",
                                   named.lexically_normal().string(), name);
  }
  return evidence;
}

Draws::Draws(const MatrixXd& covariance, int count)
    : count_(count), root_(root_of(covariance)), unit_(normals(root_.cols(), count, 1)) {}

MatrixXd Draws::errors_mm(const std::vector<const MeasuredPoint*>& points, double noise_variance,
                          unsigned seed) const {
  const auto rows = 3 * static_cast<Index>(points.size());
  MatrixXd errors = normals(rows, count_, 1000 + seed);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto at = 3 * static_cast<Index>(i);
    const Eigen::Matrix3d root =
        Eigen::LLT<Eigen::Matrix3d>(noise_variance * points[i]->noise_mm2).matrixL();
    errors.middleRows<3>(at) = (root * errors.middleRows<3>(at)).eval();
  }
  if (root_.size() == 0) return errors;
  MatrixXd by(rows, root_.cols());
  for (std::size_t i = 0; i < points.size(); ++i)
    by.middleRows<3>(3 * static_cast<Index>(i)) = points[i]->by_calibration_mm * root_;
  errors.noalias() += by * unit_;
  return errors;
}

Eigen::RowVectorXd Draws::standard_normal(unsigned seed) const {
  return normals(1, count_, 500 + seed);
}

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
  AcceptanceFigure figure{.name = "length error", .unit = "mm"};
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
    std::sort(corners.begin(), corners.end(), [](const auto* a, const auto* b) {
      return std::lexicographical_compare(a->in_world_mm.begin(), a->in_world_mm.end(),
                                          b->in_world_mm.begin(), b->in_world_mm.end());
    });
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
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
  AcceptanceFigure figure{.name = "flatness of the plate", .unit = "mm"};
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
  AcceptanceFigure figure{.name = "known shift", .unit = "mm", .may_lack = true};
  const auto position_of = [&](const std::string& set) {
    return std::ranges::find(positions, set, &Position::set);
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
  AcceptanceFigure form{.name = "form of the sphere", .unit = "mm", .may_lack = true},
      size{.name = "diameter of the sphere", .unit = "mm", .may_lack = true};
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
  AcceptanceFigure figure{.name = "noise of repeats", .unit = "of the stated"};
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
