// SPDX-License-Identifier: Apache-2.0
// How far a step of the static solver goes, and what the next one is.
#include <algorithm>
#include <cmath>

#include "simulate/equilibrium/mixture.hpp"
#include "simulate/equilibrium/solver.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kHalvings = 4;   // halvings of a step that does not lower the potential
constexpr double kPoor = 0.5;  // ratio of energy change; below, a step is corrected, iterated on
// Ratio above which a displacement by the convex matrix may be too short
constexpr double kSoft = 1.5;
constexpr double kAtSaddle = 0.1;  // residual below which a paced run may go so far, too
constexpr int kCorrections = 4;    // corrections of a step, with its factor
constexpr double kWorth = 0.02;    // gain of a correction that is worth its cost, of the prediction
constexpr double kGrow = 0.25, kShrink = 4;  // relative to mu
// While the sheet still falls its pseudo-time step stays below 0.03 s: longer ones jump from the
// fold that forms first to others, which motion does not find.
constexpr double kFalling = 20;    // residual
constexpr double kPacedMu = 1000;  // 1/s^2
constexpr double kFollowMu = 5;    // 1/s^2; from here on friction follows pressing
// Below this fraction of the sheet's energies a change of energy is lost in their rounding, and the
// forces at both ends of the step say it better.
constexpr double kBelowRounding = 1e-9;

}  // namespace

double StaticSolver::largest_of(const VectorXd& v) {
  double largest = 0;
  for (Eigen::Index i = 0; i < v.size(); i += 3)
    largest = std::max(largest, v.segment<3>(i).norm());
  return largest;
}

/// A long one lists every pair of layers that it could bring together, up to all there are.
void StaticSolver::cut_to_cap(VectorXd& step) const {
  step *= std::min(1.0, cap_m_ / std::max(largest_of(step), 1e-300));
}

void StaticSolver::move(const Field& from, const VectorXd& displacement) {
  const std::size_t n = cloth_.count();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      trial_[axis * n + i] = from[axis * n + i] + displacement[3 * i + axis];
    }
  }
}

/// Lifts out of objects what the trial puts into them, and ends it before layers pass each other;
/// returns the part of it that is left.
double StaticSolver::hold_back() {
  contacts_.retract(position, trial_);
  if (!layers_.on()) return 1;
  longest_trial_m_ = std::max(longest_trial_m_, largest_of(displacement_to_trial()));
  layers_.watch(trial_);
  const double fraction = layers_.safe_fraction(trial_);
  if (fraction < 1) {
    for (std::size_t k = 0; k < trial_.size(); ++k)
      trial_[k] = position[k] + fraction * (trial_[k] - position[k]);
  }
  return fraction;
}

VectorXd StaticSolver::displacement_to_trial() const {
  const std::size_t n = cloth_.count();
  VectorXd displacement(3 * n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      displacement[3 * i + axis] = trial_[axis * n + i] - position[axis * n + i];
    }
  }
  return displacement;
}

/// Energy that the displacement to trial_ adds to the potential, pseudo-time's part in.
double StaticSolver::potential_change(const VectorXd& displacement) {
  double change = 0;
  double gravity = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    const Vector3d move = displacement.segment<3>(3 * i);
    change += 0.5 * shift_[i] * move.squaredNorm();
    gravity -= move.dot(cloth_.mass_kg()[i] * options_.gravity_m_per_s2 + momentum_of(i));
  }
  const double energy = gravity + cloth_.energies(trial_).sum_j() + contacts_.energy_j(trial_) +
                        layers_.energy_j(trial_) - potential_j_;
  if (!(std::abs(energy) < kBelowRounding * std::abs(potential_j_))) return change + energy;
  find_forces(trial_, trial_force_);
  double slope = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    slope += displacement.segment<3>(3 * i).dot(gradient_.segment<3>(3 * i) - at(trial_force_, i));
  }
  return change + 0.5 * slope;
}

/// A correction with the same factor: takes back most of the stretch that a long straight
/// displacement of turning pieces brings.
void StaticSolver::correct() {
  const int n = cloth_.count();
  find_forces(trial_, trial_force_);
  const VectorXd displacement = displacement_to_trial();
  VectorXd step(3 * n);
  for (int i = 0; i < n; ++i) {
    step.segment<3>(3 * i) = at(trial_force_, i) - shift_[i] * displacement.segment<3>(3 * i);
  }
  factor_.solve(step);
  if (!step.allFinite()) return;  // iterate() may have left a factor that broke off
  if (layers_.on()) cut_to_cap(step);
  const Field from = trial_;
  trial_strains_ = linear_strains(cloth_, from, step);
  move(from, step);
  (void)hold_back();
}

/// Corrects the trial as long as that lowers the potential worth its cost; a solve is far cheaper
/// than the factor of another iteration. A paced run takes one at most, and only of a poor step:
/// more would lead it to other folds.
void StaticSolver::improve(double predicted, double& ratio, VectorXd& displacement) {
  const int most = options_.paced ? 1 : kCorrections;
  for (int k = 0; k < most; ++k) {
    const Field before = trial_;
    SpringStrains strains_before = trial_strains_;
    correct();
    VectorXd corrected_displacement = displacement_to_trial();
    const double corrected = -potential_change(corrected_displacement) / predicted;
    if (!(corrected > ratio)) {
      trial_strains_ = std::move(strains_before);
      trial_ = before;
      return;
    }
    const double gain = corrected - ratio;
    ratio = corrected;
    displacement = std::move(corrected_displacement);
    if (gain < kWorth) return;
  }
}

/// Not while a sheet falls at the pace of motion.
bool StaticSolver::follows_pressing() const {
  return !options_.paced && mu_ <= kFollowMu;
}

/// Gives friction the limits of the end of the step, as far as it is gone. The step then is one
/// of the potential with these limits.
void StaticSolver::follow_pressing(double fraction) {
  const double before = contacts_.energy_j(position);
  VectorXd change = VectorXd::Zero(step_.size());
  contacts_.follow_pressing(position, fraction * step_, change);
  release_pinned(change);
  gradient_ += change;
  model_gradient_ += change;
  potential_j_ += contacts_.energy_j(position) - before;
  multiply(step_, product_);
  model_curve_ = step_.dot(product_) - contacts_.excess_curve(step_) - layers_.excess_curve(step_);
}

/// Tries the step; corrects or halves it while it does not lower the potential.
bool StaticSolver::take_step(StaticReport& report) {
  double fraction = 1;
  const auto shorten = [&] {
    fraction = std::min(1.0, cap_m_ / std::max(largest_of(step_), 1e-300));
    move(position, fraction * step_);
  };
  shorten();
  if (layers_.on()) layers_.watch(trial_);
  // Two particles that enter by turns, each less deep than kDeep, would do so for ever.
  const bool in_vain = momentum_.empty() && report.iterations > progress_at_;
  const int changes =
      contacts_.review(position, trial_, in_vain ? 0 : kDeep) + layers_.review(trial_);
  // Once: what changes in a second round hardly matters, and the next step finds it.
  if (changes > 0 || follows_pressing()) {
    if (!find_step(report, Solve::changed)) return false;
    shorten();
    if (follows_pressing()) follow_pressing(fraction);
  }
  const bool capped = fraction < 1;
  const double slope = gradient_.dot(step_);
  for (int halving = 0; halving <= kHalvings; ++halving) {
    move(position, fraction * step_);
    trial_strains_ = linear_strains(cloth_, position, fraction * step_);
    const double left = hold_back();
    const double part = fraction * left;
    VectorXd displacement = displacement_to_trial();
    const double predicted = -part * slope - 0.5 * part * part * model_curve_;
    const bool tiny = std::abs(predicted) < 1e-13 * weight_n_ * cap_m_;
    double ratio = predicted > 0 ? -potential_change(displacement) / predicted : 0.0;
    const bool inexact = options_.paced ? ratio < kPoor : std::abs(ratio - 1) > kWorth;
    if (std::isfinite(ratio) && !tiny && predicted > 0 && inexact)
      improve(predicted, ratio, displacement);
    const bool soft = (!options_.paced || residual_ < kAtSaddle) && convex_ &&
                      std::isfinite(ratio) && ratio > kSoft;
    if (soft && !tiny && predicted > 0) stretch(predicted, ratio, displacement);
    if (halving == 0 && mixes() && !tiny && predicted > 0 && !(ratio > kPoor))
      iterate(report, predicted, ratio, displacement);
    if (std::isfinite(ratio) && (ratio > 0.1 || tiny)) {
      position.swap(trial_);
      strains_.swap(trial_strains_);
      moved_m_ += largest_of(displacement);
      if (mu_ > 0) pseudo_time_s_ += 1 / std::sqrt(mu_);
      plan_next(tiny ? 1 : ratio, !capped && halving == 0 && left == 1);
      return true;
    }
    fraction *= 0.5;
  }
  mu_ = std::max(mu_, 1e2) * kShrink * kShrink;
  return false;
}

/// True if a poor step is iterated on. Not while a sheet falls at the pace of motion.
bool StaticSolver::mixes() const {
  return !options_.paced || mu_ < kPacedMu;
}

/// On the path down from a start of its own, where long steps would choose another fold.
bool StaticSolver::falling() const {
  return options_.paced && residual_ > kFalling;
}

void StaticSolver::plan_next(double ratio, bool whole) {
  last_ratio_ = whole ? ratio : 0;
  if (!momentum_.empty()) return;
  if (whole && ratio > 0.7) {
    mu_ *= kGrow;
  } else if (ratio < 0.3) {
    mu_ *= kShrink;
  }
  if (mu_ < kNewtonMu) mu_ = 0;
  if (falling()) mu_ = std::max(mu_, kPacedMu);
}

}  // namespace drape::simulate
