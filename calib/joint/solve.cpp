// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/solve.hpp"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/camera_derivatives.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

using CameraBlock = std::array<double, camera_parameters>;
using PlacementBlock = std::array<double, placement_parameters>;

CameraBlock block_of(const JointCamera& camera) {
  const auto& l = std::get<BrownLens>(camera.camera.model.lens);
  const Vector3d t = camera.camera.cam_from_world.translation_m / mm;
  return {l.fx_px, l.fy_px,        l.cx_px, l.cy_px, l.k1, l.k2,  l.p1,  l.p2,
          l.k3,    camera.skew_px, 0,       0,       0,    t.x(), t.y(), t.z()};
}

PlacementBlock block_of(const Placement& placement) {
  const Vector3d t = placement.world_from_target.translation_m / mm;
  return {0, 0, 0, t.x(), t.y(), t.z()};
}

/// Rounding of a product of two columns over their lengths.
constexpr double kRounding = 1e-14;
constexpr int kColumns = camera_parameters + placement_parameters + bow_parameters;

/// All points of one frame. However many there are, the solver gets no more rows than columns: a
/// factor F of [J r]'[J r], which has the same cost, gradient and Gauss-Newton matrix.
class FrameResidual : public ceres::CostFunction {
 public:
  FrameResidual(const JointModel& model, const JointFrame& frame)
      : camera_(model.cameras[frame.camera]),
        placement_(model.placements[frame.placement]),
        bow_(model.bow),
        frame_(frame) {
    set_num_residuals(kColumns + 1);
    *mutable_parameter_block_sizes() = {camera_parameters, placement_parameters, bow_parameters};
    for (const TargetPoint& point : frame.points)
      whiteners_.emplace_back(std::sqrt(point.weight) * whitener(point.covariance_px2));
  }

  bool Evaluate(const double* const* p, double* residuals, double** jacobians) const override {
    const JointCamera camera = moved(camera_, p[0]);
    const Placement placement = moved(placement_, p[1]);
    BoardBow bow = bow_;
    bow.edge_rise_mm = Eigen::Map<const Vector2d>(p[2]);
    Eigen::Map<Eigen::Matrix<double, kColumns + 1, 1>> result(residuals);
    if (jacobians == nullptr) {
      double squares = 0;
      for (std::size_t i = 0; i < frame_.points.size(); ++i) {
        const TargetPoint& point = frame_.points[i];
        const auto px = pixel_of(camera, placement, bow, point.point_in_target);
        if (!px) return false;  // the solver takes a shorter step
        squares += (whiteners_[i] * (*px - point.px())).squaredNorm();
      }
      result.setZero();
      result[0] = std::sqrt(squares);
      return true;
    }
    // d exp(w) q / dw = -[exp(w) q]x J(w): columns of turns are multiplied with J.
    const Matrix3d camera_turn = left_jacobian(Eigen::Map<const Vector3d>(p[0] + lens_parameters));
    const Matrix3d placement_turn = left_jacobian(Eigen::Map<const Vector3d>(p[1]));
    Eigen::MatrixXd rows(2 * frame_.points.size(), kColumns + 1);
    for (std::size_t i = 0; i < frame_.points.size(); ++i) {
      const TargetPoint& point = frame_.points[i];
      auto image = image_of(camera, placement, bow, point.point_in_target);
      if (!image) return false;
      image->by_camera.middleCols<3>(lens_parameters) *= camera_turn;
      image->by_placement.leftCols<3>() *= placement_turn;
      Eigen::Matrix<double, 2, kColumns + 1> both;
      both << image->by_camera, image->by_placement, image->by_bow, image->px - point.px();
      rows.middleRows<2>(2 * static_cast<Eigen::Index>(i)) = whiteners_[i] * both;
    }
    const Factor factor = factor_of(rows);
    result = factor.col(kColumns);
    write<camera_parameters>(jacobians[0], factor, 0);
    write<placement_parameters>(jacobians[1], factor, camera_parameters);
    write<bow_parameters>(jacobians[2], factor, camera_parameters + placement_parameters);
    return true;
  }

 private:
  using Factor = Eigen::MatrixXd;

  /// F with F'F = A'A: Cholesky's factor, the largest pivot first, each in units of its column.
  /// Columns of A do depend on each other: to move the camera is to move its target.
  static Factor factor_of(const Eigen::MatrixXd& a) {
    Factor products = Factor::Zero(kColumns + 1, kColumns + 1);
    products.selfadjointView<Eigen::Lower>().rankUpdate(a.transpose());
    const Eigen::VectorXd unit = products.diagonal().cwiseSqrt();
    const Eigen::VectorXd by = unit.unaryExpr([](double u) { return u > 0 ? 1 / u : 0; });
    Factor left = products.selfadjointView<Eigen::Lower>();
    left = (by.asDiagonal() * left * by.asDiagonal()).eval();
    Factor factor = Factor::Zero(kColumns + 1, kColumns + 1);
    for (Eigen::Index row = 0; row < kColumns + 1; ++row) {
      Eigen::Index pivot = 0;
      const double largest = left.diagonal().maxCoeff(&pivot);
      if (!(largest > kRounding)) break;
      factor.row(row) = left.row(pivot) / std::sqrt(largest);
      left.noalias() -= factor.row(row).transpose() * factor.row(row);
    }
    return factor * unit.asDiagonal();
  }

  template <int columns>
  static void write(double* jacobian, const Factor& factor, int at) {
    if (jacobian == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, kColumns + 1, columns, Eigen::RowMajor>> out(jacobian);
    out = factor.middleCols<columns>(at);
  }

  const JointCamera& camera_;
  const Placement& placement_;
  const BoardBow& bow_;
  const JointFrame& frame_;
  std::vector<Eigen::Matrix2d> whiteners_;
};

/// Ceres logs a failed step to stderr although the solver is silent; its summary says the same.
[[maybe_unused]] const bool quiet = [] {
  FLAGS_minloglevel = google::GLOG_FATAL;
  return true;
}();

/// Radius of the trust region, so large that the damping is rounding.
constexpr double kNearRadius = 1e12;

ceres::Solver::Options solver_options(int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = max_iterations;
  // Far below what a covariance can tell, so that the end point does not depend on the start.
  options.function_tolerance = 1e-13;
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-14;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

/// Blocks of all parameters and the problem over them.
struct Blocks {
  std::vector<CameraBlock> cameras;
  std::vector<PlacementBlock> placements;
  std::array<double, bow_parameters> bow{};
};

void add_frames(ceres::Problem& problem, const JointModel& model, Blocks& blocks) {
  for (const JointFrame& frame : model.frames) {
    if (frame.points.empty()) continue;
    problem.AddResidualBlock(new FrameResidual(model, frame), nullptr,
                             blocks.cameras[frame.camera].data(),
                             blocks.placements[frame.placement].data(), blocks.bow.data());
  }
}

void hold_what_is_kept(ceres::Problem& problem, const JointModel& model, const JointFit& fit,
                       Blocks& blocks) {
  const std::vector<int> moved = moved_camera_parameters(fit);
  std::vector<int> kept;
  for (int i = 0; i < camera_parameters; ++i) {
    if (std::find(moved.begin(), moved.end(), i) == moved.end()) kept.push_back(i);
  }
  for (CameraBlock& block : blocks.cameras) {
    if (!problem.HasParameterBlock(block.data())) continue;
    if (moved.empty()) {
      problem.SetParameterBlockConstant(block.data());
    } else if (!kept.empty()) {
      problem.SetManifold(block.data(), new ceres::SubsetManifold(camera_parameters, kept));
    }
  }
  for (std::size_t i = 0; i < blocks.placements.size(); ++i) {
    double* block = blocks.placements[i].data();
    if (model.placements[i].known && problem.HasParameterBlock(block))
      problem.SetParameterBlockConstant(block);
  }
  if (!fit.bow && problem.HasParameterBlock(blocks.bow.data()))
    problem.SetParameterBlockConstant(blocks.bow.data());
}

ceres::ParameterBlockOrdering* placements_first(const ceres::Problem& problem, Blocks& blocks) {
  auto* ordering = new ceres::ParameterBlockOrdering;
  for (PlacementBlock& block : blocks.placements) {
    if (problem.HasParameterBlock(block.data())) ordering->AddElementToGroup(block.data(), 0);
  }
  for (CameraBlock& block : blocks.cameras) {
    if (problem.HasParameterBlock(block.data())) ordering->AddElementToGroup(block.data(), 1);
  }
  ordering->AddElementToGroup(blocks.bow.data(), 1);
  return ordering;
}

}  // namespace

std::vector<int> moved_camera_parameters(const JointFit& fit) {
  if (!fit.cameras) return {};
  if (fit.lens_known) return {10, 11, 12, 13, 14, 15};
  std::vector<int> moved = {0, 1, 2, 3, 4};
  if (fit.lens >= LensTerms::k1_k2) moved.push_back(5);
  if (fit.lens >= LensTerms::k1_k2_p1_p2) moved.insert(moved.end(), {6, 7});
  if (fit.lens >= LensTerms::k1_k2_p1_p2_k3) moved.push_back(8);
  if (fit.skew) moved.push_back(9);
  for (int i = lens_parameters; i < camera_parameters; ++i) moved.push_back(i);
  return moved;
}

JointSolution solve_joint(JointModel start, const JointFit& fit, bool near) {
  Blocks blocks;
  for (const JointCamera& camera : start.cameras) blocks.cameras.push_back(block_of(camera));
  for (const Placement& p : start.placements) blocks.placements.push_back(block_of(p));
  blocks.bow = {start.bow.edge_rise_mm.x(), start.bow.edge_rise_mm.y()};
  JointSolution solution;
  {
    ceres::Problem problem;
    add_frames(problem, start, blocks);
    hold_what_is_kept(problem, start, fit, blocks);
    ceres::Solver::Options options = solver_options(fit.max_iterations);
    if (near) options.initial_trust_region_radius = kNearRadius;
    options.linear_solver_ordering.reset(placements_first(problem, blocks));
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    solution.converged = summary.termination_type == ceres::CONVERGENCE;
    solution.iterations = static_cast<int>(summary.iterations.size());
    solution.chi2 = 2 * summary.final_cost;
  }
  solution.model = std::move(start);
  JointModel& model = solution.model;
  for (std::size_t i = 0; i < model.cameras.size(); ++i)
    model.cameras[i] = moved(model.cameras[i], blocks.cameras[i].data());
  for (std::size_t i = 0; i < model.placements.size(); ++i)
    model.placements[i] = moved(model.placements[i], blocks.placements[i].data());
  model.bow.edge_rise_mm = Vector2d(blocks.bow[0], blocks.bow[1]);
  return solution;
}

}  // namespace drape::calib
