// SPDX-License-Identifier: Apache-2.0
// What a static run notes of itself, and whether it still gets on.
#include <algorithm>
#include <cmath>

#include "simulate/equilibrium/solver.hpp"

namespace drape::simulate {
namespace {

constexpr double kLess = 0.9;        // of the least residual so far: progress
constexpr double kStillFall = 1e-7;  // m; all of the sheet lower by this much: progress

}  // namespace

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

/// Whether as many iterations as it has patience for brought neither the least residual nor the
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
