// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/time_steps.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace drape::simulate {
namespace {

/// Moves a state back along the straight path to it if layers would pass through each other.
void go_clear(const MeshCloth::State& from, MeshCloth::State& to, Pushes& pushes, bool led) {
  const double part = pushes.clear_part(from, to, led);
  if (part >= 1) return;
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = from[i] + part * (to[i] - from[i]);
}

}  // namespace

TimeStepsReport move_in_time(MeshCloth& cloth, MeshCloth::State& state,
                             const std::vector<bool>& held, MeshStiffness& stiffness,
                             Drapemeter bodies, const std::function<double(double)>& table_z_m,
                             double least_s, DescentOptions descent,
                             const TimeStepsOptions& options, Pushes* pushes, const Carry& carry) {
  using State = MeshCloth::State;
  using Eigen::Vector3d;
  const double longest_s = std::max(options.step_s, options.longest_step_s);
  const double farthest_m = options.farthest * cloth.mesh().mean_side_m();
  double dt = options.step_s, last_dt = dt;
  const auto points = static_cast<std::size_t>(cloth.points());
  const double weight_n = descent.gravity_m_per_s2.norm() *
                          std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0);
  // Velocity and displacements of the last step, and velocity of the one before it.
  State velocity(points, Vector3d::Zero()), velocity_before = velocity, before = state;
  Inertia inertia{State(points), 0};
  descent.inertia = &inertia;
  descent.residual = std::max(descent.residual, options.residual);
  TimeStepsReport report;
  double quiet_s = 0;
  while (report.time_s < least_s + options.longest_s) {
    // Coefficients of the differences: velocity = (state - known) / h.
    const double w = report.increments++ > 0 ? dt / last_dt : 0;
    report.time_s += dt;
    const double h = dt * (1 + w) / (1 + 2 * w);
    const double mass_per_s2 = 1 / (h * h), drag_per_s2 = options.drag_per_s / h;
    const auto known = [&](const State& now, const State& last, std::size_t i) -> Vector3d {
      return now[i] + w * w / (1 + 2 * w) * (now[i] - last[i]);
    };
    State from(points);
    inertia.per_s2 = mass_per_s2 + drag_per_s2;
    for (std::size_t i = 0; i < points; ++i) {
      from[i] = known(state, before, i);
      inertia.towards[i] =
          from[i] + mass_per_s2 / inertia.per_s2 * h * known(velocity, velocity_before, i);
    }
    const State last = state;
    for (std::size_t i = 0; i < state.size(); ++i)
      if (!held[i])
        state[i] += i < points ? (dt * velocity[i]).eval() : (w * (state[i] - before[i])).eval();
    if (pushes != nullptr) go_clear(last, state, *pushes, false);
    if (carry) {
      const State free = state;
      carry(report.time_s, state);
      if (pushes != nullptr) go_clear(free, state, *pushes, true);
    }
    bodies.table_z_m = table_z_m(report.time_s);
    const DescentReport found = descend(cloth, state, held, stiffness, bodies, descent, pushes);
    report.steps += found.steps;
    report.hurried += found.at_rest ? 0 : 1;
    before = last;
    velocity_before = velocity;
    double kinetic_j = 0, fastest = 0;
    for (std::size_t i = 0; i < points; ++i) {
      velocity[i] = (state[i] - from[i]) / h;
      fastest = std::max(fastest, velocity[i].norm());
      kinetic_j += cloth.mass_kg()[i] / 2 * velocity[i].squaredNorm();
    }
    if (!std::isfinite(kinetic_j)) break;
    quiet_s = kinetic_j <= weight_n * options.quiet_m ? quiet_s + dt : 0;
    report.quiet = quiet_s >= options.quiet_s && report.time_s >= least_s;
    if (report.quiet) break;
    last_dt = dt;
    // At most doubled, for which the differences are stable.
    if (2 * dt <= longest_s && 2 * dt * fastest <= farthest_m) dt *= 2;
    while (dt > options.step_s && dt * fastest > farthest_m) dt /= 2;
  }
  return report;
}

}  // namespace drape::simulate
