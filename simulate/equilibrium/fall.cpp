// SPDX-License-Identifier: Apache-2.0
// The fall of a sheet, by implicit steps in time.
#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/contact/self_distance.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/equilibrium/solver.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kGrowStep = 2, kShrinkStep = 0.5;    // relative to the step
constexpr double kGoodRatio = 0.7, kPoorRatio = 0.3;  // ratios of energy change at which it does
constexpr double kShortest_s = 1e-6;                  // step below which the fall is given up
constexpr double kReach = 0.5;  // relative to the longest displacement, that a step may be
// In m: displacement after which contacts are searched again
constexpr double kFarForContacts = 200e-6;
constexpr int kMostSteps = 5000;
// Steps without a lower energy after which the fall ends: layers beside places on a mesh, which are
// found again ever so often, can keep a sheet trembling for ever.
constexpr int kTrembles = 250;
constexpr double kLower = 1e-7;  // m; all of the sheet lower by this much: lower
constexpr int kLook = 16;        // steps between two looks whether the sheet passes through itself

}  // namespace

Vector3d StaticSolver::momentum_of(int i) const {
  return momentum_.empty() ? Vector3d(Vector3d::Zero()) : at(momentum_, i);
}

/// Backward Euler: a step minimises the potential plus m / 2 h^2 times the squared distance from
/// where inertia alone would lead, its drag in. The inertia enters as a force m v / h, so that a
/// step is one of solve() with mu = 1 / h^2. Velocities are zeroed at peaks of kinetic energy
/// (Barnes 1999) once the sheet has fallen for a while.
void StaticSolver::fall(StaticReport& report) {
  const int n = cloth_.count();
  const double quiet_j = weight_n_ * n * kQuietHeight;
  const double pin_speed = contacts_.pin_error_m(position) / kPinTravelTime;
  Field velocity(position.size(), 0.0);
  momentum_.assign(position.size(), 0.0);
  double time_s = 0, kinetic_before_j = 0;
  double step_s = std::min(options_.longest_fall_step_s, options_.first_step_s);
  bool rising = false;
  double least_j = std::numeric_limits<double>::infinity();
  int lowest_at = 0;
  const bool looks = !options_.meets_itself && options_.cloth_thickness_m > 0;
  for (int steps = 0; steps < kMostSteps && time_s < options_.longest_fall_s; ++steps) {
    double fastest = 0;
    for (int i = 0; i < n; ++i) fastest = std::max(fastest, at(velocity, i).norm());
    const double far_s = fastest > 0 ? kReach * cap_m_ / fastest : step_s;
    step_s = std::min({step_s, options_.longest_fall_step_s, far_s});
    for (int i = 0; i < n; ++i)
      put_at(momentum_, i, cloth_.mass_kg()[i] / step_s * at(velocity, i));
    for (const StaticContacts::Pinned& pin : contacts_.pinned())
      put_at(momentum_, pin.particle, Vector3d::Zero());
    const bool pins_move = carry_pins(pin_speed * step_s);
    mu_ = 1 / (step_s * step_s);
    drag_per_s2_ = options_.damping_per_s / step_s;
    begin_step();
    if (!std::isfinite(residual_)) break;
    const double energy_j = kinetic_before_j + gravity_energy_j() + inner_.sum_j();
    if (pins_move || energy_j < least_j - kLower * weight_n_ * n) {
      least_j = energy_j;
      lowest_at = steps;
    }
    if (steps - lowest_at >= kTrembles) break;
    factor_serves_ = false;
    const Field before = position;
    if (!find_step(report, Solve::again) || !take_step(report)) {
      step_s *= kShrinkStep;
      if (step_s < kShortest_s) break;
      continue;
    }
    const double taken_s = 1 / std::sqrt(mu_);
    cloth_.settle(position);
    double kinetic_j = 0;
    for (int i = 0; i < n; ++i) {
      const Vector3d v = (at(position, i) - at(before, i)) / taken_s;
      put_at(velocity, i, v);
      kinetic_j += 0.5 * cloth_.mass_kg()[i] * v.squaredNorm();
    }
    time_s += taken_s;
    step_s = taken_s * (last_ratio_ > kGoodRatio   ? kGrowStep
                        : last_ratio_ < kPoorRatio ? kShrinkStep
                                                   : 1.0);
    if (moved_m_ > kFarForContacts) {
      contacts_.refresh(position);
      moved_m_ = 0;
    }
    const bool settles = !pins_move && time_s > options_.natural_time_s;
    const bool falls = kinetic_j < kinetic_before_j;
    if (settles && falls && rising) {
      std::fill(velocity.begin(), velocity.end(), 0.0);
      kinetic_j = 0;
      rising = false;
    } else {
      rising = !falls;
    }
    kinetic_before_j = kinetic_j;
    if (settles && residual_ < options_.fall_residual && kinetic_j < quiet_j) break;
    if (looks && steps % kLook == 0 && passes_through_itself(cloth_.grid(), position)) {
      report.through_itself = true;
      break;
    }
  }
  momentum_.clear();
  drag_per_s2_ = 0;
  mu_ = 1 / (options_.first_step_s * options_.first_step_s);
  contacts_.refresh(position);
}

}  // namespace drape::simulate
