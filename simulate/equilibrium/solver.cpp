// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/equilibrium/mixture.hpp"
#include "simulate/equilibrium/residuals.hpp"

namespace drape::simulate {

namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kFaster = 0.5;  // residual over that before, else the old factor is too old
// Relative to the spacing; longest displacement of a particle in a step
constexpr double kStepCap = 0.5;
constexpr double kPinStep = 0.5;  // relative to that cap; displacement of a pin between two steps
constexpr double kWatch = 3;  // relative to that cap; nearer particles are watched during a step
constexpr double kShrinkFailed = 4;      // relative to mu, by a failed step
constexpr double kRestartMu = 10;        // 1/s^2; after an indefinite matrix
constexpr double kFoldedMu = 100;        // 1/s^2; above, a finer grid's sheet is compressed
constexpr double kSettled = 1e-2;        // residual below which points between particles are found
constexpr double kSettledOnFiner = 1;    // the same on a finer grid, which starts near its rest
constexpr double kNearRest = 0.1;        // residual below which contacts are made rigid
constexpr double kNearRestOnFiner = 10;  // the same on a finer grid
constexpr double kStiff = 1e-2;          // residual below which pieces are made stiffer
constexpr double kStiffOnFiner = 1;      // residual below which its contacts are made stiffer too
constexpr double kFarForPoints = 50e-6;  // m; path after which points are found again, as in Motion
constexpr double kFarOnFiner = 200e-6;   // m; the same on a finer grid
// Moving these points changes the potential, and where one comes and goes the sheet may follow it
// back and forth. So late in the run, and where it has not come lower since it last was found
// again, that happens ever more seldom.
constexpr double kLateMu = 100;  // 1/s^2
constexpr double kSeldom = 1.2;
constexpr int kFallsOn = 3;             // from where it stalled
constexpr int kSearches = 3;            // for points between particles near rest; then they stay
constexpr int kSearchesOnFiner = 2;     // the same on a finer grid
constexpr int kStates = 20;             // states of friction, tried for a first-order displacement
constexpr double kSmallStep_m = 1e-10;  // m; at which the states are looked at
constexpr double kSaddle = 1;           // residual below which definiteness is decided in double
constexpr double kPinned = 1e-9;        // m
constexpr double kGapDone = 2e-9;       // m
constexpr double kLoadStep_s = 0.1;     // first pseudo-time step after a change of gravity

constexpr int kSolves = 8;        // with the last factor before a new one is made
constexpr double kSolved = 0.03;  // relative to the answer, in the norm of its energy
constexpr double kAtLeast = 0.3;  // the same; a worse answer asks for a new factor
constexpr double kRough = 0.2;    // the same, of an early step, if more solves do not better it
constexpr double kDefect = 0.1;   // relative to a step's energy; more in single precision is mended

constexpr int kIterations = 3;
constexpr double kGood = 0.7;    // ratio of energy change from which the step will do
constexpr double kLonger = 1.2;  // gain in that ratio that a displacement twice as long must bring

constexpr double kLess = 0.9;        // relative to the least residual so far: progress
constexpr double kStillFall = 1e-7;  // m; all of the sheet lower by this much: progress

}  // namespace

StaticSolver::StaticSolver(Cloth& cloth, const Surroundings& surroundings,
                           const StaticOptions& options)
    : cloth_(cloth),
      surroundings_(surroundings),
      options_(options),
      contacts_(cloth, surroundings, options.friction, options.gravity_m_per_s2.norm(),
                options.contact_between_particles),
      layers_(cloth, options.gravity_m_per_s2.norm(),
              options.meets_itself ? options.cloth_thickness_m : 0),
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
  layers_.add_forces(x, force);
  const std::size_t n = x.size() / 3;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < n; ++i) {
      force[axis * n + i] += cloth_.mass_kg()[i] * options_.gravity_m_per_s2[axis];
    }
  }
  for (std::size_t k = 0; k < momentum_.size(); ++k) force[k] += momentum_[k];
  for (const StaticContacts::Pinned& pin : contacts_.pinned())
    put_at(force, pin.particle, Vector3d::Zero());
}

/// A pinned particle takes no part in a linear system.
void StaticSolver::release_pinned(VectorXd& v) const {
  for (const StaticContacts::Pinned& pin : contacts_.pinned())
    v.segment<3>(3 * pin.particle).setZero();
}

/// Takes pinned particles out of the system: they meet no other, and where the right side is zero,
/// so is the solution.
void StaticSolver::fix_pinned() {
  for (const StaticContacts::Pinned& pin : contacts_.pinned()) {
    const int i = pin.particle;
    for (int s = 1; s < GridMatrix::slots; ++s) {
      if (hessian_.has(i, s))
        hessian_.add(i + hessian_.step(s), i, Eigen::Matrix3d(-hessian_.block(i, s)));
      const int j = i - hessian_.step(s);
      if (j >= 0 && hessian_.has(j, s)) hessian_.add(i, j, Eigen::Matrix3d(-hessian_.block(j, s)));
    }
    hessian_.release(i);
    const Eigen::Matrix3d own = hessian_.diagonal(i);
    const double stiffness = own.trace() > 0 ? own.trace() / 3 : 1;  // as large as its neighbours'
    hessian_.add(i, i, Eigen::Matrix3d(stiffness * Eigen::Matrix3d::Identity() - own));
  }
}

double StaticSolver::gravity_energy_j() const {
  double sum = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    sum -= cloth_.mass_kg()[i] * at(position, i).dot(options_.gravity_m_per_s2);
  }
  return sum;
}

void StaticSolver::rest_on_contacts(double reach_m) {
  contacts_.begin(position, reach_m);
  find_forces(position, force_);
  contacts_.rest_on(position, force_, reach_m);
}

void StaticSolver::load(const Vector3d& gravity_m_per_s2) {
  options_.gravity_m_per_s2 = gravity_m_per_s2;
  options_.falls = Falls::never;
  mu_ = 1 / (kLoadStep_s * kLoadStep_s);
}

/// Contacts, forces and potential at the start of a step.
void StaticSolver::begin_step() {
  inner_force_.assign(position.size(), 0.0);
  cloth_.add_forces(position, nullptr, inner_force_);
  inner_ = cloth_.energies(position);
  layers_.begin(position);
  begin_again(StaticContacts::Limits::follow);
}

/// The same at the same place, where only contacts have changed.
void StaticSolver::begin_again(StaticContacts::Limits limits) {
  contacts_.begin(position, kWatch * cap_m_, limits);
  force_ = inner_force_;
  add_outer_forces(position, force_);
  potential_j_ = inner_.sum_j() + contacts_.energy_j(position) + layers_.energy_j(position);
  residual_ = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    const double net = (at(force_, i) - momentum_of(i)).norm();
    if (!(net <= residual_)) residual_ = net;
  }
  residual_ /= weight_n_;
}

/// Second derivatives of what layers do to each other; the matrix couples far particles for them.
void StaticSolver::add_layers(const Field& x, bool convex) {
  if (!layers_.on()) return;
  const std::vector<LayerContacts::Block> blocks = layers_.blocks(x, convex);
  std::vector<GridMatrix::Coupling> couplings;
  for (const LayerContacts::Block& block : blocks) {
    for (int k = 0; k < 4; ++k) {
      for (int l = 0; l < k; ++l) couplings.push_back({block.particle[k], block.particle[l]});
    }
  }
  hessian_.couple(std::move(couplings));
  for (const LayerContacts::Block& block : blocks) {
    for (int k = 0; k < 4; ++k) {
      for (int l = 0; l <= k; ++l) {
        hessian_.add_far(block.particle[k], block.particle[l],
                         block.matrix.block<3, 3>(3 * k, 3 * l));
      }
    }
  }
}

/// Pins go on as far as no layer passes another.
bool StaticSolver::carry_pins(double most_m) {
  if (!layers_.on()) return contacts_.carry_pins(position, most_m);
  const Field before = position;
  if (!contacts_.carry_pins(position, most_m)) return false;
  layers_.begin(before);
  layers_.watch(position);
  const double fraction = layers_.free_fraction(position);
  for (std::size_t k = 0; fraction < 1 && k < before.size(); ++k)
    position[k] = before[k] + fraction * (position[k] - before[k]);
  return true;
}

void StaticSolver::newton_matrix(bool convex) {
  hessian_.set_zero();
  // Not on the first grid: there it took the cube C at 31x31 twice the steps.
  const bool carried = !options_.paced && !strains_[0].empty();
  add_hessian(cloth_, position, convex, hessian_, carried ? &strains_ : nullptr, options_.threads);
  contacts_.add_hessian(position, convex, hessian_);
  add_layers(position, convex);
  fix_pinned();
  for (int i = 0; i < cloth_.count(); ++i) shift_[i] = (mu_ + drag_per_s2_) * cloth_.mass_kg()[i];
}

/// Factors the matrix of a step. Near rest it matters whether a soft sheet is unstable or only
/// rounded to be, and the convex matrix cannot be.
bool StaticSolver::factorise(bool convex) {
  const bool sure = convex || residual_ < kSaddle;
  return factor_.factorise(hessian_, shift_,
                           sure ? MixedFactor::Doubt::ask_double : MixedFactor::Doubt::believe);
}

/// True if the exact Hessian is positive definite.
bool StaticSolver::factorise_here() {
  using Judge = GridFactor<double>;
  begin_step();
  mu_ = 0;
  strains_ = {};
  factor_serves_ = false;
  newton_matrix(false);
  return Judge(cloth_.grid(), options_.threads, Judge::Keep::nothing).factorise(hessian_, shift_);
}

std::optional<VectorXd> StaticSolver::first_order_displacement(const VectorXd& force) {
  factor_.use_double();
  begin_step();
  mu_ = 0;
  strains_ = {};
  factor_serves_ = false;
  trial_ = position;
  VectorXd displacement;
  for (int k = 0; k < kStates; ++k) {
    newton_matrix(false);
    if (!factorise(false)) return std::nullopt;
    displacement = force;
    release_pinned(displacement);
    factor_.solve(displacement);
    move(position, kSmallStep_m / std::max(largest_of(displacement), kSmallStep_m) * displacement);
    if (contacts_.review(position, trial_, kDeep) == 0) break;
  }
  return displacement;
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
    if (changed && attempt == 0 && !layers_.lands()) {
      contacts_.change_hessian(position, convex, hessian_);
      fix_pinned();
    } else {
      newton_matrix(convex);
    }
    gradient_.resize(3 * n);
    for (int i = 0; i < n; ++i) gradient_.segment<3>(3 * i) = -at(force_, i);
    model_gradient_ = gradient_;
    contacts_.add_changes(model_gradient_);
    layers_.add_changes(model_gradient_);
    release_pinned(model_gradient_);
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
          mu_ = std::max(kNewtonMu, mu_) * kShrinkFailed;
        }
        if (mu_ == 0) mu_ = kRestartMu;
        continue;
      }
      convex_ = convex;
      factor_mu_ = mu_;
    }
    model_curve_ =
        -step_.dot(model_gradient_) - contacts_.excess_curve(step_) - layers_.excess_curve(step_);
    return step_.allFinite();
  }
  return false;
}

StaticReport StaticSolver::solve() {
  StaticReport report;
  trial_ = position;
  strains_ = {};
  contacts_.refresh(position);
  if (options_.falls == Falls::first) fall(report);
  if (!report.through_itself) go_to_rest(report);
  while (report.status == StaticStatus::stalled && options_.falls != Falls::never &&
         report.fell_on < kFallsOn && !report.through_itself) {
    ++report.fell_on;
    fall(report);
    if (!report.through_itself) go_to_rest(report);
  }
  if (report.through_itself) return report;
  finish(report);
  if (report.status == StaticStatus::at_rest && options_.judge_stability) {
    report.stable = factorise_here();
  }
  if (report.status == StaticStatus::at_rest && cloth_.laws().friction) {
    cloth_.settle(position);
    report.history.back().inner = cloth_.energies(position);
  }
  return report;
}

/// Newton's method, damped by pseudo-time far from rest.
void StaticSolver::go_to_rest(StaticReport& report) {
  best_residual_ = best_j_ = best_gap_m_ = std::numeric_limits<double>::infinity();
  progress_at_ = report.iterations;
  report.status = StaticStatus::iteration_limit;
  int searches = 0;
  const double settled = options_.paced ? kSettled : kSettledOnFiner;
  const int most_searches = options_.paced ? kSearches : kSearchesOnFiner;
  const double near_rest = options_.paced ? kNearRest : kNearRestOnFiner;
  if (!options_.paced) contacts_.let_yield();
  double far_for_points_m = options_.paced ? kFarForPoints : kFarOnFiner;
  bool fresh = true;  // points between particles are those of this position
  double least_j = std::numeric_limits<double>::infinity();  // where they were found again
  Field best = position;
  for (; report.iterations < options_.max_iterations; ++report.iterations) {
    const bool pins_move = carry_pins(kPinStep * cap_m_);
    begin_step();
    if (!std::isfinite(residual_)) {
      report.status = StaticStatus::diverged;
      position = best;
      break;
    }
    best = position;
    note(report);
    if (stagnates(report)) {
      report.status = StaticStatus::stalled;
      break;
    }
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
    if (!pins_move && residual_ < options_.residual_tolerance &&
        contacts_.pin_error_m(position) < kPinned && contacts_.gap_error_m(position) < kGapDone) {
      report.status = StaticStatus::at_rest;
      break;
    }
    if (residual_ < near_rest) {
      contacts_.update_multipliers(position);
      const double stiff = !options_.paced ? kStiffOnFiner : contacts_.has_pieces() ? kStiff : 0;
      if (residual_ < stiff) contacts_.stiffen();
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
    if (!find_step(report, Solve::again)) {
      mu_ = std::max(mu_, 1e2) * kShrinkFailed;
      continue;
    }
    if (take_step(report)) fresh = false;
  }
}

StaticReport StaticSolver::solve_nearly(double residual) {
  const StaticOptions exact = options_;
  options_.residual_tolerance = std::max(residual, exact.residual_tolerance);
  options_.only_a_start = true;
  options_.judge_stability = false;
  StaticReport report = solve();
  options_ = exact;
  return report;
}

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

void StaticSolver::note(StaticReport& report) {
  report.history.push_back({pseudo_time_s_, residual_, gravity_energy_j(),
                            contacts_.stored_j(position) + layers_.energy_j(position), inner_,
                            contacts_.touching(position)});
}

void StaticSolver::finish(StaticReport& report) {
  double squares = 0;
  for (const double f : force_) squares += f * f;
  report.residual = residual_;
  report.residual_rms = std::sqrt(squares / cloth_.count()) / weight_n_;
  report.pin_error_m = contacts_.pin_error_m(position);
  report.gap_error_m = contacts_.gap_error_m(position);
  report.longest_trial_m = longest_trial_m_;
  report.touching = contacts_.touching(position);
  report.between = contacts_.between();
  report.contact_forces = contacts_.forces(position);
  for (const LayerContacts::Push& push : layers_.pushes(position))
    report.contact_forces.push_back(
        {surroundings_.count(), push.particle, push.weight, push.force});
  report.layers = layers_.pressing(position);
  report.cloth_thickness_m = layers_.thickness_m();
}

/// True if as many iterations as it has patience for brought neither the least residual nor the
/// energy down.
bool StaticSolver::stagnates(const StaticReport& report) {
  const StaticIteration& now = report.history.back();
  const double least_fall_j = kStillFall * weight_n_ * cloth_.count();
  if (now.residual < kLess * best_residual_ || now.sum_j() < best_j_ - least_fall_j) {
    best_residual_ = std::min(best_residual_, now.residual);
    best_j_ = std::min(best_j_, now.sum_j());
    progress_at_ = report.iterations;
  }
  // Balanced forces alone are no rest: what presses may still be closing its gaps.
  if (now.residual < options_.residual_tolerance) {
    const double gap_m = contacts_.gap_error_m(position);
    if (gap_m < kLess * best_gap_m_) {
      best_gap_m_ = gap_m;
      progress_at_ = report.iterations;
    }
  }
  return report.iterations - progress_at_ >= options_.patience;
}

}  // namespace drape::simulate
