// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/solve.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;
using units::mm;

/// Initial damping: for a start from homographies, and for one near the solution.
constexpr double kFarDamping = 1e-4, kNearDamping = 1e-12, kMostDamping = 1e8;

/// Cameras, placements and board of a model: everything that a step changes.
struct Moving {
  std::vector<JointCamera> cameras;
  std::vector<Placement> placements;
  Board board;

  explicit Moving(const JointModel& model)
      : cameras(model.cameras), placements(model.placements), board(model.board) {}
  void put_back(JointModel& model) {
    model.cameras = std::move(cameras);
    model.placements = std::move(placements);
    model.board = std::move(board);
  }
};

void move(JointModel& model, const JointLayout& layout, const VectorXd& step,
          const VectorXd& points_mm) {
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const auto& l = std::get<BrownLens>(model.cameras[c].camera.model.lens);
    const Vector3d t = model.cameras[c].camera.cam_from_world.translation_m / mm;
    double p[camera_parameters] = {
        l.fx_px, l.fy_px, l.cx_px, l.cy_px, l.k1,  l.k2, l.p1, l.p2, l.k3, model.cameras[c].skew_px,
        0,       0,       0,       t.x(),   t.y(), t.z()};
    for (std::size_t i = 0; i < layout.cameras.size(); ++i)
      p[layout.cameras[i]] += step[layout.camera(c) + static_cast<Index>(i)];
    if (!layout.cameras.empty()) model.cameras[c] = moved(model.cameras[c], p);
  }
  for (std::size_t i = 0; i < model.placements.size(); ++i) {
    if (layout.placements[i] < 0) continue;
    Eigen::Matrix<double, placement_parameters, 1> p =
        step.segment<placement_parameters>(layout.placements[i]);
    p.tail<3>() += model.placements[i].world_from_target.translation_m / mm;
    model.placements[i] = moved(model.placements[i], p.data());
  }
  auto board = model.board.parameters();
  for (std::size_t i = 0; i < layout.board.size(); ++i)
    board[layout.board[i]] += step[layout.board_at + static_cast<Index>(i)];
  model.board.edge_rise_mm = board.head<2>();
  model.board.stretch = board.tail<3>();
  for (Index i = 0; i < layout.points; ++i)
    model.board.shift_mm[static_cast<std::size_t>(i)] += points_mm.segment<3>(3 * i);
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

std::vector<int> moved_board_parameters(const JointModel& model, const JointFit& fit) {
  if (fit.board == BoardKind::drawn) return {};
  std::vector<int> moved = {0, 1};
  if (fit.board == BoardKind::free || !model.lengths.empty()) {
    for (const int print : {2, 3, 4})
      if (model.board.information(print, print) > 0) moved.push_back(print);
  }
  return moved;
}

JointSolution solve_joint(JointModel start, const JointFit& fit, bool near) {
  JointSolution solution;
  solution.model = std::move(start);
  JointModel& model = solution.model;
  if (fit.board == BoardKind::free)
    model.board.shift_mm.resize(model.board.point_sd_mm.size(), Vector3d::Zero());
  double damping = near ? kNearDamping : kFarDamping, growth = 2;
  double cost = cost_of(model, fit, solution.chi2);
  if (!std::isfinite(cost)) return solution;
  while (solution.iterations < fit.max_iterations && damping < kMostDamping) {
    ++solution.iterations;
    NormalEquations normal(model, fit);
    const VectorXd pull = normal.pull.head(normal.layout.lengths_at);
    normal.eliminate_points(damping);
    const VectorXd step = normal.step();
    if (step.size() == 0) {
      damping = std::max(100 * damping, kFarDamping);
      continue;
    }
    const VectorXd points_mm = normal.points_after(step, true);
    Moving before(model);
    move(model, normal.layout, step, points_mm);
    double chi2 = 0;
    const double next = cost_of(model, fit, chi2);
    const double expected = step.head(pull.size()).dot(pull) + points_mm.dot(normal.points_pull);
    if (next < cost) {
      solution.chi2 = chi2;
      // Updates the damping by the ratio of actual to predicted decrease (Nielsen 1999).
      const double gain =
          std::clamp((cost - next) / std::max(std::abs(expected), 1e-300), 0.0, 1.0);
      damping = std::max(damping * std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)), kNearDamping);
      growth = 2;
      cost = next;
    } else {
      before.put_back(model);
      damping = std::max(growth * damping, kFarDamping);
      growth *= 2;
    }
    solution.converged = std::abs(expected) <= fit.settled * cost;
    if (solution.converged) break;
  }
  return solution;
}

}  // namespace drape::calib
