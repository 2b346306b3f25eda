// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kDeep = 1e-6;    // m; deeper entries are caught before the step is taken
constexpr int kHalvings = 4;      // of a step that does not lower the potential
constexpr double kPoor = 0.5;     // ratio of energy change; below, a step is corrected, iterated on
constexpr double kSoft = 1.5;     // ratio above which a way by the convex matrix may be too short
constexpr int kCorrections = 4;   // of a step, with its factor
constexpr double kFaster = 0.5;   // residual over that before, else the old factor is too old
constexpr double kWorth = 0.02;   // gain of a correction that is worth its cost, of the prediction
constexpr double kStepCap = 0.5;  // of the spacing; longest way of a particle in a step
constexpr double kWatch = 3;      // of that cap; nearer particles are watched during a step
constexpr double kGrow = 0.25, kShrink = 4;  // of mu
constexpr double kRestartMu = 10;            // 1/s^2; after an indefinite matrix
// While the sheet still falls its pseudo-time step stays below 0.03 s: longer ones jump from the
// fold that forms first to others, which motion does not find.
constexpr double kFalling = 20;          // residual
constexpr double kPacedMu = 1000;        // 1/s^2
constexpr double kFoldedMu = 100;        // 1/s^2; above, a finer grid's sheet is compressed
constexpr double kFollowMu = 5;          // 1/s^2; from here on friction follows pressing
constexpr double kNewtonMu = 1;          // 1/s^2; below, mu becomes 0
constexpr double kSettled = 1e-2;        // residual below which points between particles are found
constexpr double kSettledOnFiner = 1;    // the same on a finer grid, which starts near its rest
constexpr double kNearRest = 0.1;        // residual below which contacts are made rigid
constexpr double kNearRestOnFiner = 10;  // the same on a finer grid
constexpr double kStiffOnFiner = 1;      // residual below which its contacts are made stiffer too
constexpr double kFarForPoints = 50e-6;  // m; way after which points are found anew, as in Motion
constexpr double kFarOnFiner = 200e-6;   // m; the same on a finer grid
// Moving these points changes the potential, and where one comes and goes the sheet may follow it
// to and fro. So late in the run, and where it has not come lower since it last was found anew,
// that happens ever more seldom.
constexpr double kLateMu = 100;  // 1/s^2
constexpr double kSeldom = 1.2;
constexpr int kSearches = 3;         // for points between particles near rest; then they stay
constexpr int kSearchesOnFiner = 2;  // the same on a finer grid
constexpr int kStates = 20;          // of friction, tried for a first-order way
constexpr double kSmallWay = 1e-10;  // m; at which the states are looked at
constexpr double kSaddle = 1;        // residual below which definiteness is decided in double
constexpr double kPinned = 1e-9;     // m
constexpr double kGapDone = 2e-9;    // m
// Below this share of the sheet's energies a change of energy is lost in their rounding, and the
// forces at both ends of the step say it better.
constexpr double kBelowRounding = 1e-9;

}  // namespace

double StaticSolver::largest_of(const VectorXd& v) {
  double largest = 0;
  for (Eigen::Index i = 0; i < v.size(); i += 3)
    largest = std::max(largest, v.segment<3>(i).norm());
  return largest;
}

StaticSolver::StaticSolver(Cloth& cloth, const Surroundings& surroundings,
                           const StaticOptions& options)
    : cloth_(cloth),
      surroundings_(surroundings),
      options_(options),
      contacts_(cloth, surroundings, options.friction, options.gravity_m_per_s2.norm(),
                options.contact_between_particles),
      hessian_(cloth.grid()),
      factor_(cloth.grid(), options.threads),
      shift_(cloth.count(), 0.0) {
  weight_n_ = cloth.total_mass_kg() * options.gravity_m_per_s2.norm() / cloth.count();
  mu_ = 1 / (options.first_step_s * options.first_step_s);
  cap_m_ = kStepCap * std::min(cloth.grid().warp_spacing_m(), cloth.grid().weft_spacing_m());
}

void StaticSolver::find_forces(const Field& x, Field& force) const {
  force.assign(x.size(), 0.0);
  cloth_.add_forces(x, nullptr, force);
  add_outer_forces(x, force);
}

void StaticSolver::add_outer_forces(const Field& x, Field& force) const {
  contacts_.add_forces(x, force);
  const std::size_t n = x.size() / 3;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < n; ++i) {
      force[axis * n + i] += cloth_.mass_kg()[i] * options_.gravity_m_per_s2[axis];
    }
  }
}

double StaticSolver::gravity_energy_j() const {
  double sum = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    sum -= cloth_.mass_kg()[i] * at(position, i).dot(options_.gravity_m_per_s2);
  }
  return sum;
}

void StaticSolver::lean(double reach_m) {
  contacts_.begin(position, reach_m);
  find_forces(position, force_);
  contacts_.lean_on(position, force_, reach_m);
}

/// Contacts, forces and potential at the start of a step.
void StaticSolver::begin_step() {
  inner_force_.assign(position.size(), 0.0);
  cloth_.add_forces(position, nullptr, inner_force_);
  inner_ = cloth_.energies(position);
  begin_again(StaticContacts::Limits::follow);
}

/// The same at the same place, where only contacts have changed.
void StaticSolver::begin_again(StaticContacts::Limits limits) {
  contacts_.begin(position, kWatch * cap_m_, limits);
  force_ = inner_force_;
  add_outer_forces(position, force_);
  potential_j_ = inner_.sum_j() + contacts_.energy_j(position);
  residual_ = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    const double net = at(force_, i).norm();
    if (!(net <= residual_)) residual_ = net;
  }
  residual_ /= weight_n_;
}

void StaticSolver::newton_matrix(bool convex) {
  hessian_.set_zero();
  // Not on the first grid: there it took the cube C at 31x31 twice the steps.
  const bool carried = !options_.paced && !strains_[0].empty();
  add_hessian(cloth_, position, convex, hessian_, carried ? &strains_ : nullptr, options_.threads);
  contacts_.add_hessian(position, convex, hessian_);
  for (int i = 0; i < cloth_.count(); ++i) shift_[i] = mu_ * cloth_.mass_kg()[i];
}

/// Factors the matrix of a step. Near rest it matters whether a soft sheet is unstable or only
/// rounded to be, and the convex matrix cannot be.
bool StaticSolver::factorise(bool convex) {
  const bool sure = convex || residual_ < kSaddle;
  return factor_.factorise(hessian_, shift_,
                           sure ? MixedFactor::Doubt::ask_double : MixedFactor::Doubt::believe);
}

/// Whether the exact Hessian is positive definite.
bool StaticSolver::factorise_here() {
  using Judge = GridFactor<double>;
  begin_step();
  mu_ = 0;
  strains_ = {};
  factor_serves_ = false;
  newton_matrix(false);
  return Judge(cloth_.grid(), options_.threads, Judge::Keep::nothing).factorise(hessian_, shift_);
}

std::optional<VectorXd> StaticSolver::first_order_way(const VectorXd& force) {
  factor_.use_double();
  begin_step();
  mu_ = 0;
  strains_ = {};
  factor_serves_ = false;
  trial_ = position;
  VectorXd way;
  for (int k = 0; k < kStates; ++k) {
    newton_matrix(false);
    if (!factorise(false)) return std::nullopt;
    way = force;
    factor_.solve(way);
    move(position, kSmallWay / std::max(largest_of(way), kSmallWay) * way);
    if (contacts_.review(position, trial_, kDeep) == 0) break;
  }
  return way;
}

/// Solves for step_ and what the quadratic model says of it. A paced run factors each step's matrix
/// and uses that factor again only after review(): the fold it finds is motion's. On a finer grid
/// the chords of the coarser one compress the sheet at first, so that only the convex matrix can
/// be definite.
bool StaticSolver::find_step(StaticReport& report, Solve solve) {
  const int n = cloth_.count();
  const bool changed = solve == Solve::changed;
  bool convex = changed ? convex_ : !options_.paced && mu_ > kFoldedMu;
  const VectorXd guess = changed ? step_ : VectorXd();
  for (int attempt = 0; attempt < 12; ++attempt) {
    if (changed && attempt == 0) {
      contacts_.change_hessian(position, convex, hessian_);
    } else {
      newton_matrix(convex);
    }
    gradient_.resize(3 * n);
    for (int i = 0; i < n; ++i) gradient_.segment<3>(3 * i) = -at(force_, i);
    model_gradient_ = gradient_;
    contacts_.add_changes(model_gradient_);
    step_ = -model_gradient_;
    const bool serves = factor_serves_ && convex == convex_ && (changed || !options_.paced);
    const bool follows = changed && follows_pressing();
    const auto solved = [&] {
      return follows ? solve_following(guess, report) : solve_by_gradients(guess, report);
    };
    if (attempt > 0 || !serves || !solved()) {
      ++report.factorisations;
      factor_serves_ = factorise(convex) && solve_by_factor(report);
      if (!factor_serves_) {
        ++report.indefinite;
        if (!convex) {
          convex = true;
        } else if (!factor_.in_double()) {
          factor_.use_double();
          continue;
        } else {
          mu_ = std::max(kNewtonMu, mu_) * kShrink;
        }
        if (mu_ == 0) mu_ = kRestartMu;
        continue;
      }
      convex_ = convex;
      factor_mu_ = mu_;
    }
    model_curve_ = -step_.dot(model_gradient_) - contacts_.excess_curve(step_);
    return step_.allFinite();
  }
  return false;
}

void StaticSolver::move(const Field& from, const VectorXd& way) {
  const std::size_t n = cloth_.count();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      trial_[axis * n + i] = from[axis * n + i] + way[3 * i + axis];
    }
  }
}

VectorXd StaticSolver::way_to_trial() const {
  const std::size_t n = cloth_.count();
  VectorXd way(3 * n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      way[3 * i + axis] = trial_[axis * n + i] - position[axis * n + i];
    }
  }
  return way;
}

/// What the way to trial_ adds to the potential, pseudo-time's part in.
double StaticSolver::potential_change(const VectorXd& way) {
  double change = 0;
  double gravity = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    const Vector3d move = way.segment<3>(3 * i);
    change += 0.5 * shift_[i] * move.squaredNorm();
    gravity -= cloth_.mass_kg()[i] * move.dot(options_.gravity_m_per_s2);
  }
  const double energy =
      gravity + cloth_.energies(trial_).sum_j() + contacts_.energy_j(trial_) - potential_j_;
  if (!(std::abs(energy) < kBelowRounding * std::abs(potential_j_))) return change + energy;
  find_forces(trial_, trial_force_);
  double slope = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    slope += way.segment<3>(3 * i).dot(gradient_.segment<3>(3 * i) - at(trial_force_, i));
  }
  return change + 0.5 * slope;
}

/// A correction with the same factor: takes back most of the stretch that a long straight way of
/// turning pieces brings.
void StaticSolver::correct() {
  const int n = cloth_.count();
  find_forces(trial_, trial_force_);
  const VectorXd way = way_to_trial();
  VectorXd step(3 * n);
  for (int i = 0; i < n; ++i) {
    step.segment<3>(3 * i) = at(trial_force_, i) - shift_[i] * way.segment<3>(3 * i);
  }
  factor_.solve(step);
  if (!step.allFinite()) return;  // iterate() may have left a factor that broke off
  const Field from = trial_;
  trial_strains_ = linear_strains(cloth_, from, step);
  move(from, step);
  contacts_.retract(position, trial_);
}

/// Corrects the trial as long as that lowers the potential worth its cost; a solve is far cheaper
/// than the factor of another iteration. A paced run takes one at most, and only of a poor step:
/// more would lead it to other folds.
void StaticSolver::improve(double predicted, double& ratio, VectorXd& way) {
  const int most = options_.paced ? 1 : kCorrections;
  for (int k = 0; k < most; ++k) {
    const Field before = trial_;
    SpringStrains strains_before = trial_strains_;
    correct();
    VectorXd corrected_way = way_to_trial();
    const double corrected = -potential_change(corrected_way) / predicted;
    if (!(corrected > ratio)) {
      trial_strains_ = std::move(strains_before);
      trial_ = before;
      return;
    }
    const double gain = corrected - ratio;
    ratio = corrected;
    way = std::move(corrected_way);
    if (gain < kWorth) return;
  }
}

/// Not while a sheet falls at the pace of motion.
bool StaticSolver::follows_pressing() const {
  return !options_.paced && mu_ <= kFollowMu;
}

/// Gives friction the limits of the end of the step, as far as it is gone. The step then is one
/// of the potential with these limits.
void StaticSolver::follow_pressing(double share) {
  const double before = contacts_.energy_j(position);
  VectorXd change = VectorXd::Zero(step_.size());
  contacts_.follow_pressing(position, share * step_, change);
  gradient_ += change;
  model_gradient_ += change;
  potential_j_ += contacts_.energy_j(position) - before;
  multiply(step_, product_);
  model_curve_ = step_.dot(product_) - contacts_.excess_curve(step_);
}

/// Tries the step; corrects or halves it while it does not lower the potential.
bool StaticSolver::take_step(StaticReport& report) {
  double share = 1;
  const auto shorten = [&] {
    share = std::min(1.0, cap_m_ / std::max(largest_of(step_), 1e-300));
    move(position, share * step_);
  };
  shorten();
  // Once: what changes in a second round hardly matters, and the next step finds it.
  if (contacts_.review(position, trial_, kDeep) > 0 || follows_pressing()) {
    if (!find_step(report, Solve::changed)) return false;
    shorten();
    if (follows_pressing()) follow_pressing(share);
  }
  const bool capped = share < 1;
  const double slope = gradient_.dot(step_);
  for (int halving = 0; halving <= kHalvings; ++halving) {
    move(position, share * step_);
    trial_strains_ = linear_strains(cloth_, position, share * step_);
    contacts_.retract(position, trial_);
    VectorXd way = way_to_trial();
    const double predicted = -share * slope - 0.5 * share * share * model_curve_;
    const bool tiny = std::abs(predicted) < 1e-13 * weight_n_ * cap_m_;
    double ratio = predicted > 0 ? -potential_change(way) / predicted : 0.0;
    const bool inexact = options_.paced ? ratio < kPoor : std::abs(ratio - 1) > kWorth;
    if (std::isfinite(ratio) && !tiny && predicted > 0 && inexact) improve(predicted, ratio, way);
    const bool soft = !options_.paced && convex_ && std::isfinite(ratio) && ratio > kSoft;
    if (soft && !tiny && predicted > 0) stretch(predicted, ratio, way);
    if (halving == 0 && mixes() && !tiny && predicted > 0 && !(ratio > kPoor))
      iterate(report, predicted, ratio, way);
    if (std::isfinite(ratio) && (ratio > 0.1 || tiny)) {
      position.swap(trial_);
      strains_.swap(trial_strains_);
      moved_m_ += largest_of(way);
      if (mu_ > 0) pseudo_time_s_ += 1 / std::sqrt(mu_);
      plan_next(tiny ? 1 : ratio, !capped && halving == 0);
      return true;
    }
    share *= 0.5;
  }
  mu_ = std::max(mu_, 1e2) * kShrink * kShrink;
  return false;
}

/// Whether a poor step is iterated on. Not while a sheet falls at the pace of motion.
bool StaticSolver::mixes() const {
  return !options_.paced || mu_ < kPacedMu;
}

/// On the way down from a start of its own, where long steps would choose another fold.
bool StaticSolver::falling() const {
  return options_.paced && residual_ > kFalling;
}

void StaticSolver::plan_next(double ratio, bool whole) {
  if (whole && ratio > 0.7) {
    mu_ *= kGrow;
  } else if (ratio < 0.3) {
    mu_ *= kShrink;
  }
  if (mu_ < kNewtonMu) mu_ = 0;
  if (falling()) mu_ = std::max(mu_, kPacedMu);
}

void StaticSolver::note(StaticReport& report) {
  report.history.push_back({pseudo_time_s_, residual_, gravity_energy_j(),
                            contacts_.stored_j(position), inner_, contacts_.touching(position)});
}

void StaticSolver::finish(StaticReport& report) {
  double squares = 0;
  for (const double f : force_) squares += f * f;
  report.residual = residual_;
  report.residual_rms = std::sqrt(squares / cloth_.count()) / weight_n_;
  report.pin_error_m = contacts_.pin_error_m(position);
  report.gap_error_m = contacts_.gap_error_m(position);
  report.touching = contacts_.touching(position);
  report.between = contacts_.between();
  report.contact_energy_j = contacts_.stored_j(position);
}

StaticReport StaticSolver::solve() {
  StaticReport report;
  trial_ = position;
  strains_ = {};
  contacts_.refresh(position);
  int searches = 0;
  const double settled = options_.paced ? kSettled : kSettledOnFiner;
  const int most_searches = options_.paced ? kSearches : kSearchesOnFiner;
  const double near_rest = options_.paced ? kNearRest : kNearRestOnFiner;
  if (!options_.paced) contacts_.let_yield();
  double far_for_points_m = options_.paced ? kFarForPoints : kFarOnFiner;
  bool fresh = true;  // points between particles are those of this position
  double least_j = std::numeric_limits<double>::infinity();  // where they were found anew
  Field best = position;
  for (; report.iterations < options_.max_iterations; ++report.iterations) {
    begin_step();
    if (!std::isfinite(residual_)) {
      report.status = StaticStatus::diverged;
      position = best;
      break;
    }
    best = position;
    note(report);
    if (options_.only_a_start && residual_ < options_.residual_tolerance) {
      report.status = StaticStatus::at_rest;
      break;
    }
    if (residual_ < settled && searches < most_searches && !fresh) {
      contacts_.refresh(position);
      ++searches;
      fresh = true;
      continue;
    }
    if (residual_ < options_.residual_tolerance && contacts_.pin_error_m(position) < kPinned &&
        contacts_.gap_error_m(position) < kGapDone) {
      report.status = StaticStatus::at_rest;
      break;
    }
    if (residual_ < near_rest) {
      contacts_.update_multipliers(position);
      if (!options_.paced && residual_ < kStiffOnFiner) contacts_.stiffen();
      begin_again(StaticContacts::Limits::keep);
    } else if (moved_m_ > far_for_points_m) {
      contacts_.refresh(position);
      moved_m_ = 0;
      const double energy_j = report.history.back().sum_j();
      if (mu_ < kLateMu || energy_j >= least_j) far_for_points_m *= kSeldom;
      least_j = std::min(least_j, energy_j);
      begin_again(StaticContacts::Limits::follow);
    }
    factor_serves_ = factor_serves_ && mu_ == factor_mu_ && residual_ < kNearRest &&
                     residual_ < kFaster * last_residual_;
    last_residual_ = residual_;
    if (!find_step(report, Solve::anew)) {
      mu_ = std::max(mu_, 1e2) * kShrink;
      continue;
    }
    if (take_step(report)) fresh = false;
  }
  finish(report);
  if (report.status == StaticStatus::at_rest && options_.judge_stability) {
    report.stable = factorise_here();
  }
  return report;
}

}  // namespace drape::simulate
