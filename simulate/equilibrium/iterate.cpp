// SPDX-License-Identifier: Apache-2.0
// Newton iterations within a step of the static solver.
#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/equilibrium/mixture.hpp"
#include "simulate/equilibrium/solver.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kIterations = 3;
constexpr double kGood = 0.7;    // ratio of energy change from which the step will do
constexpr double kLonger = 1.2;  // gain in that ratio that a displacement twice as long must bring

}  // namespace

/// Factors the matrix of the step at trial_, its springs as trial_strains_ say.
bool StaticSolver::factorise_trial(StaticReport& report) {
  contacts_.relinearise(trial_);
  bool definite = false;
  for (const bool convex : {false, true}) {
    if (definite || (convex_ && !convex)) continue;
    hessian_.set_zero();
    add_hessian(cloth_, trial_, convex, hessian_, &trial_strains_, options_.threads);
    contacts_.add_hessian(trial_, convex, hessian_);
    add_layers(trial_, convex);
    fix_pinned();
    ++report.factorisations;
    definite = factorise(convex);
    if (!definite) ++report.indefinite;
  }
  contacts_.restore();
  return definite;
}

/// Goes on from trial_ while the potential of the step falls too little. Straight displacements
/// stretch the springs that turn, by the square of the turn, soon more than they are stretched at
/// rest; that tension makes the next matrix far too stiff across the springs. With the tension of
/// the linear model in its place two iterations undo the stretch (Magisano, Leonetti, Garcea 2017).
/// The potential may rise in between; the best trial is taken.
void StaticSolver::iterate(StaticReport& report, double predicted, double& ratio,
                           VectorXd& displacement) {
  const int n = cloth_.count();
  Field best = trial_;
  VectorXd best_displacement = displacement;
  SpringStrains best_strains = trial_strains_;
  if (!std::isfinite(ratio)) ratio = std::numeric_limits<double>::lowest();
  factor_serves_ = false;
  for (int k = 0; k < kIterations && ratio < kGood; ++k) {
    find_forces(trial_, trial_force_);
    const VectorXd here = displacement_to_trial();
    VectorXd step(3 * n);
    for (int i = 0; i < n; ++i) {
      step.segment<3>(3 * i) = at(trial_force_, i) - shift_[i] * here.segment<3>(3 * i);
    }
    if (!step.allFinite() || !factorise_trial(report)) break;
    factor_.solve(step);
    if (!step.allFinite()) break;
    cut_to_cap(step);
    const Field from = trial_;
    trial_strains_ = linear_strains(cloth_, from, step);
    move(from, step);
    (void)hold_back();
    VectorXd now = displacement_to_trial();
    const double reached = -potential_change(now) / predicted;
    if (!(reached > ratio)) continue;
    ratio = reached;
    best = trial_;
    best_displacement = std::move(now);
    best_strains = trial_strains_;
  }
  trial_ = std::move(best);
  displacement = std::move(best_displacement);
  trial_strains_ = std::move(best_strains);
}

/// Doubles a displacement by the convex matrix as long as the potential falls well on. Near a
/// saddle the sheet leaves in a direction that has no stiffness, while that matrix has some and
/// would creep.
void StaticSolver::stretch(double predicted, double& ratio, VectorXd& displacement) {
  while (2 * largest_of(displacement) <= cap_m_) {
    const Field before = trial_;
    move(position, 2 * displacement);
    (void)hold_back();
    VectorXd longer = displacement_to_trial();
    const double reached = -potential_change(longer) / predicted;
    if (!(reached > kLonger * ratio)) {
      trial_ = before;
      return;
    }
    ratio = reached;
    displacement = std::move(longer);
    trial_strains_ = {};  // no linear model led there
  }
}

}  // namespace drape::simulate
