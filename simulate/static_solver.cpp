// SPDX-License-Identifier: Apache-2.0
#include "simulate/static_solver.hpp"

#include <algorithm>
#include <cmath>

namespace drape::sim {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kDeep = 20e-6;   // m; deeper entries are caught before the step is taken
constexpr int kCatches = 3;       // solves with more particles caught, per iteration
constexpr int kHalvings = 4;      // of a step that does not lower the energy
constexpr double kPoor = 0.5;     // ratio of energy change below which a step is corrected
constexpr double kStepCap = 0.5;  // of the spacing; longest way of a particle in a step
constexpr double kGrow = 0.25, kShrink = 4;  // of mu
constexpr double kRestartMu = 10;            // 1/s^2; after an indefinite matrix
constexpr double kNewtonMu = 1;              // 1/s^2; below, mu becomes 0
constexpr double kSettled = 1e-2;        // residual below which springs yield and points are found
constexpr double kFarForPoints = 50e-6;  // m; way after which points are found anew, as in Motion
constexpr int kSearches = 5;             // for points between particles near rest; then they stay
constexpr int kConvexRuns = 2;     // iterations with the convex matrix after an indefinite one
constexpr double kPinned = 1e-9;   // m
constexpr double kGapDone = 2e-9;  // m

Vector3d at(const Field& x, int i) {
  const std::size_t n = x.size() / 3;
  return {x[i], x[n + i], x[2 * n + i]};
}

double largest_of(const VectorXd& v) {
  double largest = 0;
  for (Eigen::Index i = 0; i < v.size(); i += 3)
    largest = std::max(largest, v.segment<3>(i).norm());
  return largest;
}

}  // namespace

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

void StaticSolver::forces(const Field& x, Field& force) const {
  force.assign(x.size(), 0.0);
  cloth_.add_forces(x, nullptr, force);
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

bool StaticSolver::newton_matrix(bool convex) {
  hessian_.set_zero();
  add_hessian(cloth_, position, convex, hessian_);
  contacts_.add_hessian(position, convex, hessian_);
  if (!convex) contacts_.add_surface_curvature(position, force_, hessian_);
  for (int i = 0; i < cloth_.count(); ++i) shift_[i] = mu_ * cloth_.mass_kg()[i];
  return true;
}

bool StaticSolver::factorise_here() {
  forces(position, force_);
  contacts_.settle(position, force_);
  mu_ = 0;
  newton_matrix(false);
  hessian_.project(contacts_.projectors(), contacts_.restricted(), cloth_.laws().tensile[0].slope);
  return factor_.factorise(hessian_, shift_);
}

/// Solves for step_, catching particles that would enter an object. gradient_ becomes that after
/// the lift to the surfaces, so that step_ - lift is judged by it.
bool StaticSolver::find_step(StaticReport& report) {
  const int n = cloth_.count();
  const double stand_in = cloth_.laws().tensile[0].slope;
  bool convex = convex_left_ > 0;
  if (convex) --convex_left_;
  for (int attempt = 0; attempt < 12; ++attempt) {
    newton_matrix(convex);
    gradient_.resize(3 * n);
    for (int i = 0; i < n; ++i) gradient_.segment<3>(3 * i) = -at(force_, i);
    gradient_ -= contacts_.friction();
    hessian_.multiply(contacts_.lift(), lifted_);
    hessian_.project(contacts_.projectors(), contacts_.restricted(), stand_in);
    ++report.factorisations;
    if (!factor_.factorise(hessian_, shift_)) {
      ++report.indefinite;
      if (!convex) {
        convex = true;
        convex_left_ = kConvexRuns;
      } else {
        mu_ = std::max(kNewtonMu, mu_) * kShrink;
      }
      if (mu_ == 0) mu_ = kRestartMu;
      continue;
    }
    exact_ = !convex && mu_ == 0;
    step_ = -gradient_ - lifted_;
    for (int i = 0; i < n; ++i) {
      if (contacts_.restricted()[i] != 0) {
        step_.segment<3>(3 * i) = contacts_.projectors()[i] * step_.segment<3>(3 * i);
      }
    }
    factor_.solve(step_);
    return step_.allFinite();
  }
  return false;
}

/// The trial position's gradient, and what the way there changes the energy by, measured by the
/// forces at both ends (trapezoid), which counts friction's work as well.
double StaticSolver::leg(const VectorXd& way, const VectorXd& before, VectorXd& after) {
  const int n = cloth_.count();
  forces(trial_, trial_force_);
  after.resize(3 * n);
  for (int i = 0; i < n; ++i) after.segment<3>(3 * i) = -at(trial_force_, i);
  after -= contacts_.friction();
  return 0.5 * way.dot(before + after);
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

/// A correction with the same factor: takes back most of the stretch that a long straight way of
/// turning pieces brings. Returns the change of energy on its leg.
double StaticSolver::correct(VectorXd& way, const VectorXd& gradient, double share) {
  const int n = cloth_.count();
  VectorXd step(3 * n);
  for (int i = 0; i < n; ++i) {
    step.segment<3>(3 * i) = -contacts_.projectors()[i] *
                             (gradient.segment<3>(3 * i) + shift_[i] * way.segment<3>(3 * i));
  }
  factor_.solve(step);
  const Field from = trial_;
  move(from, step);
  contacts_.retract(position, trial_);
  step = way_to_trial() - contacts_.lift() * share - way;
  way += step;
  VectorXd after;
  return leg(step, gradient, after);
}

/// Tries the step; corrects or halves it while it does not lower the energy. The way to the
/// surfaces is taken first and not judged: contact forces bear it.
bool StaticSolver::take_step(StaticReport& report) {
  double share = 1;
  const auto shorten = [&] {
    share = std::min(1.0, cap_m_ / std::max(largest_of(step_ + contacts_.lift()), 1e-300));
    move(position, share * (contacts_.lift() + step_));
  };
  shorten();
  for (int catches = 0; catches < kCatches; ++catches) {
    if (contacts_.catch_entering(position, trial_, kDeep) == 0) break;
    if (!find_step(report)) return false;
    shorten();
  }
  const bool capped = share < 1;
  VectorXd product;
  hessian_.multiply(step_, product);
  const double curve = step_.dot(product);
  for (int halving = 0; halving <= kHalvings; ++halving) {
    VectorXd way = share * step_;
    move(position, share * contacts_.lift() + way);
    contacts_.retract(position, trial_);
    way = way_to_trial() - share * contacts_.lift();
    const VectorXd before = gradient_ + share * lifted_;
    VectorXd after;
    double change = leg(way, before, after);
    const double predicted = -share * before.dot(step_) - 0.5 * share * share * curve;
    const bool tiny = predicted < 1e-13 * weight_n_ * cap_m_;
    double ratio = predicted > 0 ? -change / predicted : 0.0;
    if (std::isfinite(change) && ratio < kPoor && !tiny) {
      change += correct(way, after, share);
      ratio = -change / predicted;
    }
    if (std::isfinite(change) && (ratio > 0.1 || tiny)) {
      position.swap(trial_);
      moved_m_ += largest_of(way);
      if (mu_ > 0) pseudo_time_s_ += 1 / std::sqrt(mu_);
      plan_next(tiny ? 1 : ratio, capped || halving > 0 ? 0.5 : 1);
      return true;
    }
    share *= 0.5;
  }
  mu_ = std::max(mu_, 1e2) * kShrink * kShrink;
  return false;
}

void StaticSolver::plan_next(double ratio, double share) {
  if (share == 1 && ratio > 0.7) {
    mu_ *= kGrow;
  } else if (ratio < 0.3) {
    mu_ *= kShrink;
  }
  if (mu_ < kNewtonMu) mu_ = 0;
}

void StaticSolver::note(StaticReport& report) {
  report.history.push_back({pseudo_time_s_, residual_, gravity_energy_j(),
                            contacts_.energy_j(position), cloth_.energies(position),
                            contacts_.touching()});
}

bool StaticSolver::finish(StaticReport& report) {
  report.residual = residual_;
  report.residual_rms = contacts_.rms_n() / weight_n_;
  report.pin_error_m = contacts_.pin_error_m(position);
  report.gap_error_m = contacts_.gap_error_m(position);
  report.touching = contacts_.touching();
  report.between = contacts_.between();
  report.contact_energy_j = contacts_.energy_j(position);
  return true;
}

StaticReport StaticSolver::solve() {
  StaticReport report;
  trial_ = position;
  contacts_.touch_what_lies_on(position, options_.touching_at_start_m);
  contacts_.refresh(position);
  contacts_.yield(position);
  int searches = 0;
  bool fresh = true;  // points between particles and springs are those of this position
  Field best = position;
  for (; report.iterations < options_.max_iterations; ++report.iterations) {
    forces(position, force_);
    residual_ = contacts_.settle(position, force_) / weight_n_;
    if (!std::isfinite(residual_)) {
      report.status = StaticStatus::diverged;
      position = best;
      finish(report);
      return report;
    }
    best = position;
    note(report);
    const bool placed =
        contacts_.pin_error_m(position) < kPinned && contacts_.gap_error_m(position) < kGapDone;
    if (residual_ < kSettled && searches < kSearches && !fresh) {
      contacts_.refresh(position);
      contacts_.yield(position);
      ++searches;
      fresh = true;
      continue;
    }
    if (residual_ < options_.residual_tolerance && placed) {
      report.status = StaticStatus::at_rest;
      break;
    }
    if (moved_m_ > kFarForPoints) {
      contacts_.refresh(position);
      moved_m_ = 0;
    }
    if (!find_step(report)) {
      mu_ = std::max(mu_, 1e2) * kShrink;
      continue;
    }
    fresh = false;
    if (take_step(report)) {
      contacts_.follow(trial_, position);
      if (residual_ < kSettled) contacts_.update_pins(position);
    }
  }
  finish(report);
  if (report.status == StaticStatus::at_rest) report.stable = factorise_here();
  return report;
}

void lift_out(const Surroundings& surroundings, Field& position) {
  const int n = static_cast<int>(position.size() / 3);
  for (int i = 0; i < n; ++i) {
    for (int shape = 0; shape < surroundings.count(); ++shape) {
      const Vector3d p = at(position, i);
      const double gap = surroundings.gap_m(shape, p);
      if (gap >= 0) continue;
      const Vector3d out = p - gap * surroundings.normal(shape, p);
      for (int axis = 0; axis < 3; ++axis) {
        position[static_cast<std::size_t>(axis) * n + i] = out[axis];
      }
    }
  }
}

Field prolong(const Field& coarse, const GridSpec& from, const GridSpec& to) {
  const std::size_t m = from.count();
  const std::size_t n = to.count();
  struct Weights {
    int first = 0;
    double weight[4] = {};
  };
  const auto along = [](int count_from, int count_to, int k) {
    const double u = static_cast<double>(k) * (count_from - 1) / (count_to - 1);
    Weights w;
    const int points = std::min(4, count_from);
    w.first = std::clamp(static_cast<int>(std::floor(u)) - 1, 0, count_from - points);
    for (int a = 0; a < points; ++a) {
      w.weight[a] = 1;
      for (int b = 0; b < points; ++b) {
        if (b != a) w.weight[a] *= (u - w.first - b) / (a - b);
      }
    }
    return w;
  };
  Field fine(3 * n, 0.0);
  for (int r = 0; r < to.rows; ++r) {
    const Weights wr = along(from.rows, to.rows, r);
    for (int c = 0; c < to.cols; ++c) {
      const Weights wc = along(from.cols, to.cols, c);
      for (int axis = 0; axis < 3; ++axis) {
        double sum = 0;
        for (int a = 0; a < 4; ++a) {
          for (int b = 0; b < 4; ++b) {
            const double weight = wr.weight[a] * wc.weight[b];
            if (weight == 0) continue;
            sum += weight * coarse[axis * m + from.index(wr.first + a, wc.first + b)];
          }
        }
        fine[axis * n + to.index(r, c)] = sum;
      }
    }
  }
  return fine;
}

}  // namespace drape::sim
