// SPDX-License-Identifier: Apache-2.0
#include "calib/tsai/tsai.hpp"

#include <ceres/ceres.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/camera_model.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {

using Eigen::Matrix2d, Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d,
    Eigen::VectorXd;
using units::mm;

namespace {

/// Focal lengths of an ideal camera in pixels per unit of x/z and y/z.
Eigen::Vector2d focal_px(const CameraModel& model) {
  if (const auto* brown = std::get_if<BrownLens>(&model.lens)) return {brown->fx_px, brown->fy_px};
  const auto& tsai = std::get<TsaiLens>(model.lens);
  return {tsai.focal_m * tsai.scale_x / tsai.pixel_pitch_x_m, tsai.focal_m / tsai.pixel_pitch_y_m};
}

void add(ErrorMeasure& measure, double error) {
  measure.mean += error;
  measure.max = std::max(measure.max, error);
}

/// Parameters in the order and units of parameter_names(); the rotation is relative to the start,
/// so that the solver avoids the discontinuity of the rotation vector at half a turn.
constexpr int kParameters = 11;
enum Index { focal, kappa, cx, cy, scale, turn, translation = 8, tz = 10 };
using Parameters = std::array<double, kParameters>;

Parameters parameters_of(const Camera& camera) {
  const auto& lens = std::get<TsaiLens>(camera.model.lens);
  const Vector3d t = camera.cam_from_world.translation_m / mm;
  return {lens.focal_m / mm,
          lens.kappa1_per_m2 * mm * mm,
          lens.cx_px,
          lens.cy_px,
          lens.scale_x,
          0,
          0,
          0,
          t.x(),
          t.y(),
          t.z()};
}

Camera camera_of(const Camera& start, const double* p) {
  Camera camera = start;
  auto& lens = std::get<TsaiLens>(camera.model.lens);
  lens.focal_m = p[focal] * mm;
  lens.kappa1_per_m2 = p[kappa] / (mm * mm);
  lens.cx_px = p[cx];
  lens.cy_px = p[cy];
  lens.scale_x = p[scale];
  camera.cam_from_world.rotation =
      rotation_about(Eigen::Map<const Vector3d>(p + turn)) * start.cam_from_world.rotation;
  camera.cam_from_world.translation_m = Eigen::Map<const Vector3d>(p + translation) * mm;
  return camera;
}

std::vector<int> kept_parameters(TsaiFree free) {
  if (free == TsaiFree::all) return {};
  if (free == TsaiFree::all_but_scale_x) return {scale};
  return {cx, cy, scale, turn, turn + 1, turn + 2, translation, translation + 1};
}

class PointResidual : public ceres::SizedCostFunction<2, kParameters> {
 public:
  PointResidual(const Camera& start, const Correspondence& point)
      : start_(start), point_(point), whitener_(whitener(point.covariance_px2)) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const double* p = parameters[0];
    const Camera camera = camera_of(start_, p);
    const Vector3d translated = camera.cam_from_world * point_.point_in_world;
    const auto image = project(camera.model, translated);
    if (!image) return false;  // makes the solver take a shorter step
    Eigen::Map<Vector2d>(residuals, 2) = whitener_ * (image->px - point_.px);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, 2, kParameters, Eigen::RowMajor>> jacobian(jacobians[0]);
    jacobian.leftCols<5>() = *d_px_d_lens(camera.model, translated);
    // d(exp(w) q)/dw = -[exp(w) q]x J(w), written column by column as cross products.
    const Vector3d rotated = translated - camera.cam_from_world.translation_m;
    const Matrix3d left = left_jacobian(Eigen::Map<const Vector3d>(p + turn));
    for (int i = 0; i < 3; ++i)
      jacobian.col(turn + i) = image->d_px_d_point * left.col(i).cross(rotated);
    jacobian.rightCols<3>() = image->d_px_d_point * mm;
    jacobian = (whitener_ * jacobian).eval();
    return true;
  }

 private:
  const Camera& start_;
  const Correspondence& point_;
  Matrix2d whitener_;
};

/// Silences Ceres, which logs failed steps to stderr; its summary reports them too.
[[maybe_unused]] const bool quiet = [] {
  FLAGS_minloglevel = google::GLOG_FATAL;
  return true;
}();

ceres::Solver::Options solver_options(int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = max_iterations;
  // Far below the statistical uncertainty, so that the result does not depend on the start.
  options.function_tolerance = 1e-15;
  options.parameter_tolerance = 1e-13;
  options.gradient_tolerance = 1e-14;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

constexpr double kRankTolerance = 1e-9;

/// Position on the sensor from the image centre (metres), with s_x = 1.
Vector2d on_sensor(const Correspondence& p, const TsaiSensor& sensor) {
  return {(p.px.x() - sensor.cx_px) * sensor.pixel_pitch_x_m,
          (p.px.y() - sensor.cy_px) * sensor.pixel_pitch_y_m};
}

/// Least squares with columns scaled to unit length; nullopt if rank-deficient.
std::optional<VectorXd> solve(MatrixXd a, const VectorXd& b) {
  const VectorXd scale = a.colwise().norm();
  if (!a.allFinite() || scale.minCoeff() <= 0) return std::nullopt;
  a = (a * scale.cwiseInverse().asDiagonal()).eval();
  Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
  qr.setThreshold(kRankTolerance);
  if (qr.rank() < a.cols()) return std::nullopt;
  return VectorXd(qr.solve(b).cwiseQuotient(scale));
}

/// Rotation with the roll, pitch and yaw of the two estimated rows, which noise makes slightly
/// non-orthogonal; as in Willson's program.
Eigen::Matrix3d rotation_of_rows(const Vector3d& row1, const Vector3d& row2) {
  const Vector3d row3 = row1.cross(row2);
  const double yaw = std::atan2(row2.x(), row1.x());
  const double s = std::sin(yaw), c = std::cos(yaw);
  const double pitch = std::atan2(-row3.x(), row1.x() * c + row2.x() * s);
  const double roll = std::atan2(row1.z() * s - row2.z() * c, row2.y() * c - row1.y() * s);
  using Eigen::AngleAxisd;
  return (AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(pitch, Vector3d::UnitY()) *
          AngleAxisd(roll, Vector3d::UnitX()))
      .toRotationMatrix();
}

const Correspondence& farthest_from_centre(const std::vector<Correspondence>& points,
                                           const TsaiSensor& sensor) {
  return *std::ranges::max_element(
      points, {}, [&](const Correspondence& p) { return on_sensor(p, sensor).squaredNorm(); });
}

/// Sign of Ty: positive if the farthest point and its image have equal signs in the camera frame.
double sign_of_ty(const Vector2d& xy_in_camera_for_positive_ty, const Vector2d& sensor_xy) {
  return xy_in_camera_for_positive_ty.cwiseProduct(sensor_xy).sum() >= 0 ? 1.0 : -1.0;
}

/// Solves the radial alignment constraint for the 7 (or 5) unknowns over Ty.
std::optional<VectorXd> solve_over_ty(const std::vector<Correspondence>& points,
                                      const TsaiSensor& sensor, Eigen::Index dimensions) {
  const auto n = static_cast<Eigen::Index>(points.size());
  if (n < 2 * dimensions + 1) return std::nullopt;
  MatrixXd a(n, 2 * dimensions + 1);
  VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector2d s = on_sensor(points[i], sensor);
    const auto world = points[i].point_in_world.head(dimensions).transpose();
    a.row(i) << s.y() * world, s.y(), -s.x() * world;
    b[i] = s.x();
  }
  return solve(a, b);
}

std::optional<RadialAlignment> align_about_origin(const std::vector<Correspondence>& points,
                                                  const TsaiSensor& sensor) {
  const std::optional<VectorXd> over_ty = solve_over_ty(points, sensor, 3);
  if (!over_ty) return std::nullopt;
  const Vector3d row1 = over_ty->head<3>(), row2 = over_ty->tail<3>();
  double ty = 1 / row2.norm();
  const double scale_x = ty * row1.norm();
  const Correspondence& far = farthest_from_centre(points, sensor);
  const Vector2d xy((row1.dot(far.point_in_world) + (*over_ty)[3]) * ty,
                    (row2.dot(far.point_in_world) + 1) * ty);
  ty *= sign_of_ty(xy, on_sensor(far, sensor));
  const RadialAlignment result{rotation_of_rows(row1 * ty / scale_x, row2 * ty),
                               (*over_ty)[3] * ty / scale_x, ty, scale_x};
  if (!result.rotation.allFinite() || !(scale_x > 0)) return std::nullopt;
  return result;
}

/// Homogeneous form of the constraint, without division by Ty. It is regular at Ty = 0 but weights
/// noise differently, so only the second row and Ty are taken from it.
struct SecondRow {
  Vector3d row;
  double ty_m = 0;
};

/// `dimensions` of the world: 3, or 2 for a plane, whose second row then lacks its third element.
std::optional<SecondRow> homogeneous_second_row(const std::vector<Correspondence>& points,
                                                const TsaiSensor& sensor, Eigen::Index dimensions) {
  const auto n = static_cast<Eigen::Index>(points.size());
  const Eigen::Index half = dimensions + 1;
  MatrixXd a(n, 2 * half);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector2d s = on_sensor(points[i], sensor);
    const auto world = points[i].point_in_world.head(dimensions).transpose();
    a.row(i) << s.y() * world, s.y(), -s.x() * world, -s.x();
  }
  const VectorXd scale = a.colwise().norm();
  if (!a.allFinite() || scale.minCoeff() <= 0) return std::nullopt;
  a = (a * scale.cwiseInverse().asDiagonal()).eval();
  const Eigen::JacobiSVD<MatrixXd> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const VectorXd solution = svd.matrixV().col(2 * half - 1).cwiseQuotient(scale);
  const double length = solution.segment(half, dimensions).norm();
  if (!(length > 0)) return std::nullopt;
  SecondRow second{Vector3d::Zero(), solution[2 * half - 1] / length};
  second.row.head(dimensions) = solution.segment(half, dimensions) / length;
  return second;
}

/// RMS distance of the points from their mean.
double extent(const std::vector<Correspondence>& points) {
  Vector3d mean = Vector3d::Zero();
  for (const Correspondence& p : points) mean += p.point_in_world;
  mean /= static_cast<double>(points.size());
  double sum = 0;
  for (const Correspondence& p : points) sum += (p.point_in_world - mean).squaredNorm();
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/// Ty^2 for one plane, from the four known rotation terms over Ty (Tsai 1987, eq. 17).
double ty_squared_coplanar(const Vector2d& row1, const Vector2d& row2) {
  const double sum = row1.squaredNorm() + row2.squaredNorm();
  const double det = row1.x() * row2.y() - row1.y() * row2.x();
  if (std::abs(det) < 1e-12 * sum) return 1 / std::max(row1.squaredNorm(), row2.squaredNorm());
  return 2 / (sum + std::sqrt(std::max(0.0, sum * sum - 4 * det * det)));
}

std::optional<RadialAlignment> align_plane_about_origin(const std::vector<Correspondence>& points,
                                                        const TsaiSensor& sensor) {
  const std::optional<VectorXd> over_ty = solve_over_ty(points, sensor, 2);
  if (!over_ty) return std::nullopt;
  const Vector2d row1 = over_ty->head<2>(), row2 = over_ty->tail<2>();
  double ty = std::sqrt(ty_squared_coplanar(row1, row2));
  const Correspondence& far = farthest_from_centre(points, sensor);
  const Vector2d plane_point = far.point_in_world.head<2>();
  const Vector2d xy((row1.dot(plane_point) + (*over_ty)[2]) * ty, (row2.dot(plane_point) + 1) * ty);
  ty *= sign_of_ty(xy, on_sensor(far, sensor));
  const auto third = [](const Vector2d& v) {
    return std::sqrt(std::max(0.0, 1 - v.squaredNorm()));
  };
  const Vector2d r1 = row1 * ty, r2 = row2 * ty;
  const double opposite = r1.dot(r2) > 0 ? -1.0 : 1.0;
  const RadialAlignment result{
      rotation_of_rows({r1.x(), r1.y(), third(r1)}, {r2.x(), r2.y(), opposite * third(r2)}),
      (*over_ty)[2] * ty, ty};
  if (!result.rotation.allFinite()) return std::nullopt;
  return result;
}

using Alignment = std::optional<RadialAlignment>(const std::vector<Correspondence>&,
                                                 const TsaiSensor&);

/// Stage 1 for Ty near 0, where the division of every unknown by Ty fails: shifts the origin along
/// the camera's y, solves, and shifts it back.
std::optional<RadialAlignment> align_off_the_axis(const std::vector<Correspondence>& points,
                                                  const TsaiSensor& sensor, Eigen::Index dimensions,
                                                  Alignment& align) {
  const std::optional<SecondRow> second = homogeneous_second_row(points, sensor, dimensions);
  if (!second) return std::nullopt;
  const double size = extent(points);
  if (std::abs(second->ty_m) > 0.1 * size) return align(points, sensor);
  const Vector3d origin = size * second->row;
  std::vector<Correspondence> shifted = points;
  for (Correspondence& p : shifted) p.point_in_world -= origin;
  std::optional<RadialAlignment> result = align(shifted, sensor);
  if (!result) return std::nullopt;
  const Vector3d back = result->rotation * origin;
  result->tx_m -= back.x();
  result->ty_m -= back.y();
  result->origin_shifted = true;
  return result;
}

}  // namespace

Eigen::Matrix2d whitener(const Eigen::Matrix2d& covariance_px2) {
  return Eigen::Matrix2d(covariance_px2.llt().matrixL()).inverse();
}

const FrameDetections* find_frame(const Detections& detections, const std::string& set,
                                  const std::string& camera) {
  const auto found = std::find_if(
      detections.frames.begin(), detections.frames.end(),
      [&](const FrameDetections& frame) { return frame.set == set && frame.camera == camera; });
  return found == detections.frames.end() ? nullptr : &*found;
}

void check_lattice(const Detections& detections, const Rig& rig, const Target& target) {
  const MarkLattice& lattice = detections.lattice;
  if (lattice.surface != Surface::target) {
    throw bad_input("the detections are of a cloth, not of the calibration target", {},
                    "give the file that `drape detect --surface target` wrote");
  }
  if (lattice.rows != target.rows || lattice.cols != target.cols ||
      lattice.pitch_m != target.pitch_m || lattice.dot_diameter_m != target.dot_diameter_m) {
    throw bad_input(
        fmt::format("the dots were detected with another target: {} x {} dots, pitch {} mm, "
                    "diameter {} mm",
                    lattice.rows, lattice.cols, lattice.pitch_m / mm, lattice.dot_diameter_m / mm),
        {.file = rig.target_file.string()}, "detect again with this target file");
  }
}

void check_frame(const FrameDetections& frame, const RigCamera& camera) {
  if (frame.width_px != camera.width_px || frame.height_px != camera.height_px) {
    throw bad_input(fmt::format("the image is {} x {} px, the rig's camera has {} x {} px",
                                frame.width_px, frame.height_px, camera.width_px, camera.height_px),
                    {.camera = frame.camera, .set = frame.set},
                    "correct width_px and height_px in rig.toml or record again");
  }
}

void check_detection(const Detection& d, const FrameDetections& frame) {
  const Eigen::LLT<Eigen::Matrix2d> factor(d.covariance_px2);
  if (!d.centre_px.allFinite() || !d.covariance_px2.allFinite() ||
      factor.info() != Eigen::Success) {
    throw bad_input(
        fmt::format("dot ({}, {}) has a position or covariance that is not a finite number or "
                    "not positive",
                    d.mark.row, d.mark.col),
        {.camera = frame.camera, .set = frame.set}, "detect this frame again");
  }
}

ClassicalErrors classical_errors(const Camera& camera, const std::vector<Correspondence>& points) {
  ClassicalErrors errors;
  const Eigen::Vector2d focal = focal_px(camera.model);
  int count = 0;
  for (const Correspondence& point : points) {
    const double distorted = distance_px(camera, point);
    const auto ray = unproject(camera.model, point.px);
    if (!std::isfinite(distorted) || !ray) continue;
    const Eigen::Vector3d in_camera = camera.cam_from_world * point.point_in_world;
    const Eigen::Vector2d off = ray->hnormalized() - in_camera.hnormalized();
    add(errors.distorted_px, distorted);
    add(errors.undistorted_px, focal.cwiseProduct(off).norm());
    add(errors.object_mm, *miss_m(camera, point) / mm);
    ++count;
  }
  for (ErrorMeasure* measure : {&errors.distorted_px, &errors.undistorted_px, &errors.object_mm})
    measure->mean /= std::max(count, 1);
  errors.normalised = normalised_error(camera, points);
  return errors;
}

std::optional<double> miss_m(const Camera& camera, const Correspondence& point) {
  const auto ray = unproject(camera.model, point.px);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d in_camera = camera.cam_from_world * point.point_in_world;
  return (in_camera - in_camera.dot(*ray) * *ray).norm();
}

double distance_px(const Camera& camera, const Correspondence& point) {
  const auto image = project(camera.model, camera.cam_from_world * point.point_in_world);
  return image ? (image->px - point.px).norm() : std::numeric_limits<double>::infinity();
}

CalibrationResiduals residuals_of(const Camera& camera, const std::vector<Correspondence>& points) {
  CalibrationResiduals result;
  double sum_px2 = 0, sum_mm2 = 0;
  for (const Correspondence& point : points) {
    const double px = distance_px(camera, point);
    const auto miss = miss_m(camera, point);
    if (!std::isfinite(px) || !miss) continue;
    ++result.points;
    sum_px2 += px * px;
    sum_mm2 += *miss * *miss / (mm * mm);
    result.max_px = std::max(result.max_px, px);
  }
  if (result.points > 0) {
    result.rms_px = std::sqrt(sum_px2 / result.points);
    result.object_rms_mm = std::sqrt(sum_mm2 / result.points);
  }
  return result;
}

double normalised_error(const Camera& camera, const std::vector<Correspondence>& points) {
  // Rounding to whole pixels in x and y has a variance of (pitch^2)/12 in each.
  const Eigen::Vector2d pitch = focal_px(camera.model).cwiseInverse();
  const double rounding = std::sqrt(pitch.squaredNorm() / 12);
  double sum = 0;
  for (const Correspondence& point : points) {
    const Eigen::Vector3d in_camera = camera.cam_from_world * point.point_in_world;
    const auto ray = unproject(camera.model, point.px);
    if (!ray) return std::numeric_limits<double>::infinity();
    const Eigen::Vector3d at_depth = *ray * (in_camera.z() / ray->z());
    sum += (at_depth - in_camera).norm() / (in_camera.z() * rounding);
  }
  return points.empty() ? 0 : sum / static_cast<double>(points.size());
}

CalibratedCamera calibrated_of(const Camera& camera, const std::vector<Correspondence>& points,
                               const MatrixXd& covariance) {
  CalibratedCamera calibrated;
  calibrated.camera = camera;
  calibrated.residuals = residuals_of(camera, points);
  calibrated.valid_region_px = covered_region_px(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d& place = points[(points.size() / 2 + i) % points.size()].point_in_world;
    const auto image = project(camera.model, camera.cam_from_world * place);
    if (!image) continue;
    calibrated.worked_point = {place, image->px};
    break;
  }
  if (covariance.size() > 0) {
    calibrated.covariance_parameters = parameter_names(camera.model);
    calibrated.covariance = covariance;
  }
  return calibrated;
}

Eigen::Vector4d covered_region_px(const std::vector<Correspondence>& points) {
  Eigen::AlignedBox2d box;
  for (const Correspondence& point : points) box.extend(point.px);
  Eigen::Vector4d region;
  region << box.min(), box.max();
  return region;
}

int free_parameters(TsaiFree free) {
  return kParameters - static_cast<int>(kept_parameters(free).size());
}

Refinement refine_tsai(const Camera& start, const std::vector<Correspondence>& points,
                       TsaiFree free, int max_iterations) {
  Parameters parameters = parameters_of(start);
  ceres::Problem problem;
  for (const Correspondence& point : points)
    problem.AddResidualBlock(new PointResidual(start, point), nullptr, parameters.data());
  const std::vector<int> kept = kept_parameters(free);
  if (!kept.empty())
    problem.SetManifold(parameters.data(), new ceres::SubsetManifold(kParameters, kept));
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(max_iterations), &problem, &summary);
  return {camera_of(start, parameters.data()), summary.termination_type == ceres::CONVERGENCE,
          static_cast<int>(summary.iterations.size()), 2 * summary.final_cost};
}

Eigen::MatrixXd tsai_covariance(const Camera& camera, const std::vector<Correspondence>& points,
                                TsaiFree free) {
  const std::vector<int> kept = kept_parameters(free);
  std::vector<int> moved;
  for (int i = 0; i < kParameters; ++i) {
    if (std::find(kept.begin(), kept.end(), i) == kept.end()) moved.push_back(i);
  }
  Eigen::MatrixXd jacobian(2 * points.size(), moved.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto all = d_px_d_parameters(camera, points[i].point_in_world);
    if (!all) return {};
    jacobian.middleRows<2>(2 * static_cast<Eigen::Index>(i)) =
        whitener(points[i].covariance_px2) * (*all)(Eigen::all, moved);
  }
  const Eigen::VectorXd scale = jacobian.colwise().norm();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(jacobian * scale.cwiseInverse().asDiagonal(),
                                              Eigen::ComputeThinV);
  const auto& values = svd.singularValues();
  if (!(values.minCoeff() > 1e-10 * values.maxCoeff())) return {};
  const Eigen::MatrixXd half =
      scale.cwiseInverse().asDiagonal() * svd.matrixV() * values.cwiseInverse().asDiagonal();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(kParameters, kParameters);
  covariance(moved, moved) = half * half.transpose();
  return covariance;
}

std::optional<RadialAlignment> align_non_coplanar(const std::vector<Correspondence>& points,
                                                  const TsaiSensor& sensor) {
  if (points.size() < 7) return std::nullopt;
  return align_off_the_axis(points, sensor, 3, align_about_origin);
}

std::optional<RadialAlignment> align_coplanar(const std::vector<Correspondence>& points,
                                              const TsaiSensor& sensor) {
  if (points.size() < 5) return std::nullopt;
  return align_off_the_axis(points, sensor, 2, align_plane_about_origin);
}

RadialAlignment mirrored(const RadialAlignment& alignment) {
  RadialAlignment result = alignment;
  const Eigen::Vector3d plane(1, 1, -1);
  result.rotation = plane.asDiagonal() * alignment.rotation * plane.asDiagonal();
  return result;
}

std::optional<FocalAndDepth> solve_focal_and_depth(const std::vector<Correspondence>& points,
                                                   const TsaiSensor& sensor,
                                                   const RadialAlignment& alignment) {
  const auto n = static_cast<Eigen::Index>(points.size());
  MatrixXd a(n, 2);
  VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector3d rotated = alignment.rotation * points[i].point_in_world;
    const double y = on_sensor(points[i], sensor).y();
    a.row(i) << rotated.y() + alignment.ty_m, -y;
    b[i] = rotated.z() * y;
  }
  const std::optional<VectorXd> solution = solve(a, b);
  if (!solution || !solution->allFinite()) return std::nullopt;
  return FocalAndDepth{(*solution)[0], (*solution)[1]};
}

Camera start_camera(const TsaiSensor& sensor, const RadialAlignment& alignment,
                    const FocalAndDepth& depth) {
  const TsaiLens lens{depth.focal_m,         0,
                      sensor.cx_px,          sensor.cy_px,
                      alignment.scale_x,     sensor.pixel_pitch_x_m,
                      sensor.pixel_pitch_y_m};
  return {"", {lens}, {alignment.rotation, {alignment.tx_m, alignment.ty_m, depth.tz_m}}};
}

}  // namespace drape::calib
