// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/time_steps.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace drape::simulate {
namespace {

/// Takes a state back along the straight path to it, where that leads cloth through cloth.
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
  const double dt = options.step_s;
  const auto points = static_cast<std::size_t>(cloth.points());
  const double weight_n = descent.gravity_m_per_s2.norm() *
                          std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0);
  // Displacements of the last step and of the one before it.
  State velocity(points, Vector3d::Zero()), velocity_before = velocity, before = state;
  Inertia inertia{State(points), 0};
  descent.inertia = &inertia;
  descent.residual = std::max(descent.residual, options.residual);
  descent.factor_every = options.factor_every;
  TimeStepsReport report;
  double quiet_s = 0;
  while (report.time_s < least_s + options.longest_s) {
    const bool second = report.increments > 0;
    report.time_s = ++report.increments * dt;
    const double h = second ? 2 * dt / 3 : dt;  // velocity = (state - known) / h
    const double mass_per_s2 = 1 / (h * h), drag_per_s2 = options.drag_per_s / h;
    const auto known = [&](const State& now, const State& last, std::size_t i) -> Vector3d {
      return second ? ((4 * now[i] - last[i]) / 3).eval() : now[i];
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
      if (!held[i]) state[i] += i < points ? (dt * velocity[i]).eval() : state[i] - before[i];
    if (pushes != nullptr) go_clear(last, state, *pushes, false);
    if (carry) {
      const State free = state;
      carry(report.time_s, state);
      if (pushes != nullptr) go_clear(free, state, *pushes, true);
    }
    bodies.table_z_m = table_z_m(report.time_s);
    descent.keep_matrix = report.increments > 2;  // from the second step on, inertia is the same
    const DescentReport found = descend(cloth, state, held, stiffness, bodies, descent, pushes);
    report.steps += found.steps;
    report.hurried += found.at_rest ? 0 : 1;
    before = last;
    velocity_before = velocity;
    double kinetic_j = 0;
    for (std::size_t i = 0; i < points; ++i) {
      velocity[i] = (state[i] - from[i]) / h;
      kinetic_j += cloth.mass_kg()[i] / 2 * velocity[i].squaredNorm();
    }
    if (!std::isfinite(kinetic_j)) break;
    quiet_s = kinetic_j <= weight_n * options.quiet_m ? quiet_s + dt : 0;
    report.quiet = quiet_s >= options.quiet_s && report.time_s >= least_s;
    if (report.quiet) break;
  }
  return report;
}

}  // namespace drape::simulate
