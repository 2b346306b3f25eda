// SPDX-License-Identifier: Apache-2.0
#include "simulate/motion_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.hpp"
#include "simulate/overlaps.hpp"
#include "simulate/start/start_check.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

constexpr int kDampMoreSteps = 60000;       // steps after which a still sheet trembles
constexpr double kStillDamping = 500;       // beta / m from then on, 1/s
constexpr int kRestCheck = 64;              // steps between two looks at the residual
constexpr double kKineticSmoothing = 4e-3;  // s; peaks of the folding count, not those of rattling
constexpr double kTimeResolution = 1e-12;   // s
constexpr double kPinPlaced = 1e-9;         // m
constexpr int kProgressSteps = 512;

}  // namespace

void MotionRun::start(const StartState& state, bool relaxed, SimulateReport& report) {
  motion_.position = state.position;
  holds_ = state.holds;
  hold_in_world_ = state.hold_in_world;
  motion_.hold(holds_);
  Eigen::Matrix3Xd rate(3, static_cast<Eigen::Index>(holds_.size()));
  double farthest = 0;
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    const Vector3d displacement = hold_in_world_[h] - motion_.held_point(h);
    rate.col(static_cast<Eigen::Index>(h)) = displacement / kPinTravelTime;
    farthest = std::max(farthest, displacement.norm());
  }
  if (farthest > kPinPlaced) {
    motion_.move_holds(rate);
    pins_placed_s_ = kPinTravelTime;
  }
  if (farthest > 1 * mm) {
    report.warnings.push_back(fmt::format(
        "a pin starts {:.1f} mm from its place and is moved there in the first {:.1f} s",
        farthest / mm, kPinTravelTime));
  }
  for (const std::string& fault : faults_of_start(cloth_.grid(), motion_.position, surroundings_)) {
    report.warnings.push_back(fault);
  }
  const int moved = motion_.push_out();
  if (moved > 0) report.warnings.push_back(warning_of_lifted(moved));
  damped_from_s_ = std::max(pins_placed_s_, relaxed ? 0.0 : options_.natural_time_s);
  report.energy_start_j = total_energy_j();
}

bool MotionRun::quiet() const {
  return motion_.kinetic_energy_j() < weight_n_ * kQuietHeight && time_s_ >= pins_placed_s_;
}

double MotionRun::total_energy_j() const {
  return motion_.kinetic_energy_j() + motion_.gravity_energy_j() +
         cloth_.energies(motion_.position).sum_j() +
         motion_.line_contacts().energy_j(motion_.position) +
         motion_.pair_contacts().energy_j(motion_.position);
}

void MotionRun::place_pins() {
  if (pins_placed_s_ == 0 || time_s_ < pins_placed_s_ - kTimeResolution || !motion_.holds_move())
    return;
  motion_.move_holds(Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(holds_.size())));
}

/// Also when every place of contact is searched again.
bool MotionRun::rests() {
  if (!quiet() || !(motion_.residual() < options_.residual_tolerance)) return false;
  motion_.seek_contacts();
  return motion_.residual() < options_.residual_tolerance;
}

/// Barnes 1999: at a peak of (smoothed) kinetic energy the cloth passes near an equilibrium;
/// a new start from there leaves the equilibria unchanged and gets there sooner.
void MotionRun::damp_kinetically(double step_s, SimulateReport& report) {
  const double fraction = std::min(1.0, step_s / kKineticSmoothing);
  const double smooth =
      smooth_kinetic_j_ + fraction * (motion_.step_kinetic_j() - smooth_kinetic_j_);
  const bool falling = smooth < smooth_kinetic_j_;
  if (options_.kinetic_damping && time_s_ > damped_from_s_ && falling && rising_) {
    motion_.stop();
    ++report.kinetic_stops;
    smooth_kinetic_j_ = 0;
    rising_ = false;
    return;
  }
  rising_ = !falling;
  smooth_kinetic_j_ = smooth;
}

/// A sheet that is nearly still may tremble for ever where contacts between particles come and go;
/// damping changes no equilibrium, so such a run gets enough of it to still them.
void MotionRun::damp_more(SimulateReport& report) {
  if (!quiet() || damped_more_ || options_.damping_per_s >= kStillDamping) return;
  damped_more_ = true;
  motion_.set_damping_per_s(kStillDamping);
  report.warnings.push_back(
      fmt::format("still but trembling after {} steps: damping raised to {:g} per s", report.steps,
                  kStillDamping));
}

void MotionRun::note(SimulateResult& result) {
  const InternalEnergies inner = cloth_.energies(motion_.position);
  result.history.push_back({time_s_, motion_.kinetic_energy_j(), motion_.gravity_energy_j(),
                            inner.stretch_j, inner.shear_j, inner.bending_j, inner.twist_j,
                            motion_.line_contacts().energy_j(motion_.position) +
                                motion_.pair_contacts().energy_j(motion_.position),
                            motion_.residual(), motion_.contacts()});
}

void MotionRun::go(SimulateResult& result) {
  SimulateReport& report = result.report;
  double step_s = motion_.stable_step_s(options_.step_fraction);
  report.step_least_s = report.step_most_s = step_s;
  report.sentence.clear();
  while (report.steps < options_.max_steps) {
    if (report.steps % options_.steps_between_looks == 0) {
      step_s = motion_.stable_step_s(options_.step_fraction);
      if (!std::isfinite(step_s + motion_.kinetic_energy_j())) break;
      report.step_least_s = std::min(report.step_least_s, step_s);
      report.step_most_s = std::max(report.step_most_s, step_s);
    }
    if (time_s_ >= next_note_s_) {
      note(result);
      next_note_s_ += options_.history_interval_s;
    }
    if (report.steps % kRestCheck == 0 && report.steps > 0 && rests()) {
      report.status = RestStatus::at_rest;
      break;
    }
    if (options_.progress && report.steps % kProgressSteps == 0) {
      options_.progress(static_cast<double>(report.steps) / static_cast<double>(options_.max_steps),
                        motion_.residual());
    }
    const double until_placed_s = pins_placed_s_ - time_s_;
    time_s_ +=
        motion_.step(until_placed_s > kTimeResolution ? std::min(step_s, until_placed_s) : step_s);
    ++report.steps;
    place_pins();
    if (report.steps % kDampMoreSteps == 0) damp_more(report);
    damp_kinetically(step_s, report);
  }
  note(result);
  certify(report);
}

void MotionRun::load(const Vector3d& gravity_m_per_s2, SimulateReport& report) {
  const double before_j = total_energy_j();
  motion_.load(gravity_m_per_s2);
  report.energy_start_j += total_energy_j() - before_j;
  report.status = RestStatus::step_limit;
  report.hold_error_m = 0;
}

void MotionRun::certify(SimulateReport& report) {
  report.time_s = time_s_;
  report.backtracked_steps = motion_.backtracked_steps();
  report.residual = motion_.residual();
  report.residual_rms = motion_.residual_rms();
  report.residual_tolerance = options_.residual_tolerance;
  report.kinetic_j = motion_.kinetic_energy_j();
  report.strains = cloth_.strains(motion_.position);
  report.contacts = motion_.contacts();
  report.contacts_between = motion_.line_contacts().count();
  report.contacts_pairs = motion_.pair_contacts().pressing(motion_.position);
  report.deepest_edge_m = motion_.pair_contacts().deepest_solid_m(motion_.position);
  report.energy_end_j = total_energy_j();
  report.lost_viscous_j = motion_.viscous_loss_j();
  report.found_contacts_j = motion_.found_contacts_j();
  report.lost_kinetic_stops_j = motion_.stopped_j();
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    report.hold_error_m =
        std::max(report.hold_error_m, (motion_.held_point(h) - hold_in_world_[h]).norm());
  }
  if (!std::isfinite(report.residual + report.kinetic_j)) {
    report.status = RestStatus::diverged;
    report.sentence = fmt::format("diverged after {} steps", report.steps);
    return;
  }
  measure_gaps(cloth_.grid(), surroundings_, motion_.position, report);
  report.sentence =
      report.status == RestStatus::at_rest
          ? "at rest"
          : fmt::format("not at rest after {} steps: residual {:.2g} of a particle's weight",
                        report.steps, report.residual);
}

}  // namespace drape::simulate
