// SPDX-License-Identifier: Apache-2.0
#include "simulate/motion_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.hpp"
#include "simulate/contact/piercing.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/start/clamps.hpp"
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

// m; a particle deeper than this in an object is no result, cloth between particles a warning
constexpr double kSunk = 0.1e-3;
constexpr double kThrough = 0.25;  // relative to a body's thickness; deeper is through its middle
constexpr double kTurned_rad = 45 * units::deg;  // a half triple beyond it bends like no curve

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

void measure_gaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                  SimulateReport& report) {
  constexpr int kSamples = 8;  // per cell side
  report.least_gap_table_m = 1e9;
  report.least_gap_object_m.reset();
  report.deepest_between_m = 0;
  for (int shape = 0; shape < surroundings.count(); ++shape) {
    double least = 1e9;
    for (int i = 0; i < grid.count(); ++i) {
      if (grid.cells_at(i / grid.cols, i % grid.cols) == 0) continue;
      least = std::min(least, surroundings.gap_m(shape, at(position, i)));
    }
    if (surroundings.is_table(shape)) {
      report.least_gap_table_m = std::min(report.least_gap_table_m, least);
    } else {
      report.least_gap_object_m = std::min(report.least_gap_object_m.value_or(1e9), least);
    }
    for (int cell = 0; cell < grid.count(); ++cell) {
      if (!grid.has_cell(cell / grid.cols, cell % grid.cols)) continue;
      const Vector3d a = at(position, cell), b = at(position, cell + 1);
      const Vector3d c = at(position, cell + grid.cols);
      const Vector3d d = at(position, cell + grid.cols + 1);
      for (int k = 0; k <= kSamples * (kSamples + 2); ++k) {
        const int across = k / (kSamples + 1);
        const int along = k % (kSamples + 1);
        const double u = across / static_cast<double>(kSamples);
        const double v = along / static_cast<double>(kSamples);
        const Vector3d p = (1 - u) * ((1 - v) * a + v * b) + u * ((1 - v) * c + v * d);
        report.deepest_between_m =
            std::max(report.deepest_between_m, -surroundings.gap_m(shape, p));
      }
    }
  }
}

void judge_overlaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                    const SimulateOptions& options, SimulateReport& report) {
  // A cell of straight lines lies inside a round body by its width squared over four radii, so what
  // a coarse grid cannot follow is measured by the grid.
  const double spacing_m = std::max(grid.warp_spacing_m(), grid.weft_spacing_m());
  report.penetration_tolerance_m =
      std::max(options.penetration_tolerance_m, options.penetration_fraction * spacing_m);
  if (report.status == RestStatus::diverged) return;
  const SelfDistance self = self_distance(grid, position);
  report.least_self_distance_m = self.least_m;
  report.self_crossings = self.crossings;
  std::string fault;
  const double depth_m =
      -std::min(report.least_gap_table_m, report.least_gap_object_m.value_or(0.0));
  if (depth_m > kSunk) fault = fmt::format("{:.2g} mm inside an object or the table", depth_m / mm);
  if (report.deepest_between_m > report.penetration_tolerance_m) {
    fault = fmt::format("between its particles {:.2g} mm inside an object",
                        report.deepest_between_m / mm);
  } else if (report.deepest_between_m > kSunk) {
    report.warnings.push_back(
        fmt::format("between its particles the sheet reaches {:.2f} mm into an object",
                    report.deepest_between_m / mm));
  }
  // Such a contact sinks in by 2 um per particle's weight: one that is jammed so deep is no rest.
  if (report.deepest_edge_m > kSunk)
    fault = fmt::format("with an edge or corner of an object {:.2g} mm deep in it",
                        report.deepest_edge_m / mm);
  const double through = through_part(grid, position, surroundings);
  if (through > kThrough)
    fault = fmt::format("passing through an object, {:.0f} % of its thickness deep", 100 * through);
  report.pierced_m = std::max(pierced_m(grid, position, surroundings),
                              rim_through_m(grid, position, surroundings));
  if (report.pierced_m > report.penetration_tolerance_m)
    fault = fmt::format("pierced: an edge of an object stands {:.2g} mm through it",
                        report.pierced_m / mm);
  if (self.crossings > 0)
    fault = fmt::format("passing through itself in {} pairs of triangles", self.crossings);
  if (fault.empty()) return;
  if (report.status == RestStatus::at_rest) {
    report.status = RestStatus::penetrates;
    report.sentence = fmt::format("still, but {}, after {} steps", fault, report.steps);
  } else {
    report.warnings.push_back("the sheet is " + fault);
  }
}

void judge_clamps(const Scene& scene, const GridSpec& grid, const Sheet& sheet,
                  SimulateReport& report) {
  if (sheet.marks.size() != static_cast<std::size_t>(grid.count())) return;
  double most_rad = 0;
  for (const ClampedPlace& place : clamps_on(scene, grid).places) {
    const Vector3d edge =
        sheet.marks[place.next].point_in_world - sheet.marks[place.held].point_in_world;
    most_rad =
        std::max(most_rad, std::atan2(std::abs(edge.dot(place.normal)), edge.dot(place.forward)));
  }
  if (most_rad > kTurned_rad)
    report.warnings.push_back(
        fmt::format("the cloth leaves a clamp at {:.0f} degrees to its direction within one grid "
                    "spacing: the bend there is unresolved; give a finer grid",
                    most_rad / units::deg));
}

}  // namespace drape::simulate
