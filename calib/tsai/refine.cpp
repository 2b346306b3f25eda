// SPDX-License-Identifier: Apache-2.0
#include "calib/tsai/refine.hpp"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <array>

#include "core/camera_derivatives.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

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

/// Silences Ceres, which logs a failed step to stderr even so; its summary reports it too.
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

}  // namespace

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
  Refinement result;
  result.camera = camera_of(start, parameters.data());
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.iterations = static_cast<int>(summary.iterations.size());
  result.chi2 = 2 * summary.final_cost;
  return result;
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

}  // namespace drape::calib
