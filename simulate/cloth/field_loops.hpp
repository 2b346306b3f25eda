// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

#include "simulate/cloth/cloth.hpp"

/// Loops over all particles that a step of the motion is made of; they vectorise.
namespace drape::simulate {

/// result = x + step * direction.
void axpy(const Field& x, double step, const Field& direction, Field& result);

/// The next stage of Runge-Kutta: start_x + reach * stage_v and start_v + reach * stage_a.
struct RungeKuttaFields {
  const Field& start_x;
  const Field& start_v;
  const Field& stage_a;
  Field& stage_x;
  Field& stage_v;
};
void runge_kutta_stage(const RungeKuttaFields& fields, double reach);

/// The end of a step of Runge-Kutta from the accelerations of its four stages (the stages'
/// velocities follow from them): x + dt v + dt^2 / 6 (a1 + a2 + a3) and
/// v + dt / 6 (a1 + 2 a2 + 2 a3 + a4).
void runge_kutta_end(const Field& start_x, const Field& start_v, const std::array<Field, 4>& a,
                     double step, Field& x, Field& v);

struct OuterForces {
  Eigen::Vector3d gravity_m_per_s2;
  double damping_per_s = 0;
  double air_drag_kg_per_m3 = 0;
};
/// Turns forces (N) into accelerations (m/s^2) with gravity, damping and air drag at velocity v.
void forces_to_accelerations(const OuterForces& outer, const std::vector<double>& area_m2,
                             const std::vector<double>& inverse_mass, const Field& v, Field& a);

/// Sums over the velocities of a step.
struct Speeds {
  double kinetic_j = 0;
  double power_w = 0;  ///< that damping and air drag take
  double fastest2 = 0;
};
/// Adds the particles' path lengths in a step to `paths_m`; a step of 0 leaves them.
[[nodiscard]] Speeds sum_speeds(const OuterForces& outer, const std::vector<double>& area_m2,
                                const std::vector<double>& mass_kg, const Field& v, double step_s,
                                std::vector<double>& paths_m);

}  // namespace drape::simulate
