// SPDX-License-Identifier: Apache-2.0
// The linear systems of the static solver's steps.
#include <cmath>

#include "simulate/equilibrium/residuals.hpp"
#include "simulate/equilibrium/solver.hpp"

namespace drape::simulate {
namespace {

using Eigen::VectorXd;

constexpr int kSolves = 8;        // with the last factor before a new one is made
constexpr double kSolved = 0.03;  // of the answer, in the norm of its energy
constexpr double kAtLeast = 0.3;  // the same; a worse answer asks for a new factor
constexpr double kRough = 0.2;    // the same, of an early step, if more solves do not better it
constexpr double kDefect = 0.1;   // of a step's energy; more in single precision is mended

}  // namespace

/// product = the matrix of the step times x.
void StaticSolver::multiply(const VectorXd& x, VectorXd& product) const {
  hessian_.multiply(x, product);
  for (int i = 0; i < cloth_.count(); ++i) {
    product.segment<3>(3 * i) += shift_[i] * x.segment<3>(3 * i);
  }
}

/// Conjugate gradients with the last factor as preconditioner (Hestenes, Stiefel 1952): where only
/// some contacts have changed since, or single precision fell short, a few solves do. step_ comes
/// in as the right side; false when that did not work, with step_ as it came in. `guess` is where
/// the answer is sought from; nothing: from zero. An early step of a finer grid needs no more than
/// its direction, and where a guess is not even as good as zero after half the solves, a new factor
/// is cheaper.
bool StaticSolver::solve_by_gradients(const VectorXd& guess, StaticReport& report) {
  VectorXd rest = step_;
  VectorXd answer = VectorXd::Zero(rest.size());
  double energy = 0;  // about that of the answer; what is left is measured by it
  if (guess.size() == rest.size()) {
    answer = guess;
    energy = guess.dot(rest);
    multiply(answer, product_);
    rest -= product_;
  }
  VectorXd preconditioned = rest;
  factor_.solve(preconditioned);
  ++report.reused;
  double size = rest.dot(preconditioned);
  if (!(energy > 0)) energy = size;
  const double enough = kSolved * kSolved * energy;
  if (size < enough) {
    step_ = answer;
    return true;
  }
  const bool early = !options_.paced && !follows_pressing();
  VectorXd displacement = preconditioned;
  for (int k = 0; k < kSolves && size > 0; ++k) {
    if (early && k == kSolves / 2 && size > energy) return false;
    multiply(displacement, product_);
    const double curve = displacement.dot(product_);
    if (!(curve > 0)) return false;
    answer += size / curve * displacement;
    rest -= size / curve * product_;
    preconditioned = rest;
    factor_.solve(preconditioned);
    ++report.reused;
    const double next = rest.dot(preconditioned);
    if (next < enough) {
      step_ = answer;
      return step_.allFinite();
    }
    displacement = preconditioned + next / size * displacement;
    size = next;
  }
  if (!early || !(size < kRough * kRough * energy) || !answer.allFinite()) return false;
  step_ = answer;
  return true;
}

/// Solves with the factor just made of the matrix. In single precision a soft displacement may come
/// out too short; the energy that the matrix gives it shows that, and conjugate gradients mend it.
/// False when they do not.
bool StaticSolver::solve_by_factor(StaticReport& report) {
  const VectorXd right = step_;
  factor_.solve(step_);
  if (factor_.in_double()) return true;
  if (!step_.allFinite()) return false;
  multiply(step_, product_);
  const double defect = 1 - step_.dot(product_) / right.dot(step_);
  if (!(std::abs(defect) >= kDefect)) return true;
  const VectorXd guess = step_;
  step_ = right;
  return solve_by_gradients(guess, report);
}

/// Solves, from `guess` on, with limits of friction that follow the pressing forces. The matrix of
/// that is not symmetric, but near the factor's. step_ comes in as the right side without that
/// part; false when little was gained, with step_ as it came in.
bool StaticSolver::solve_following(const VectorXd& guess, StaticReport& report) {
  VectorXd lag = VectorXd::Zero(step_.size());
  contacts_.add_lag(lag);
  release_pinned(lag);
  const NearlySymmetric system{[this](const VectorXd& x, VectorXd& product) {
                                 multiply(x, product);
                                 contacts_.add_following(x, product);
                                 release_pinned(product);
                               },
                               [this](VectorXd& b) { factor_.solve(b); }};
  const double energy = std::abs(guess.dot(step_));
  VectorXd answer = guess;
  const ResidualsLeft left =
      minimise_residuals(system, step_ - lag, answer, kSolved * kSolved * energy, kSolves);
  report.reused += left.solves;
  if (!(left.energy < kAtLeast * kAtLeast * energy) || !answer.allFinite()) return false;
  step_ = answer;
  return true;
}

}  // namespace drape::simulate
