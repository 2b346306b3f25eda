// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "simulate/cloth.hpp"

/// Loops over all particles that a step of the motion is made of; they vectorise.
namespace drape::sim {

/// result = x + step * direction.
void axpy(const Field& x, double step, const Field& direction, Field& result);

/// One stage of Runge-Kutta: adds weight * (stage_v, stage_a) to the sums and sets the next stage
/// to start + reach * (stage_v, stage_a).
struct RungeKuttaFields {
  const Field& start_x;
  const Field& start_v;
  const Field& stage_a;
  Field& stage_x;
  Field& stage_v;
  Field& sum_x;
  Field& sum_v;
};
void runge_kutta_stage(const RungeKuttaFields& fields, double weight, double reach);

struct OuterForces {
  Eigen::Vector3d gravity_m_per_s2;
  double damping_per_s = 0;
  double air_drag_kg_per_m3 = 0;
};
/// Turns forces (N) into accelerations (m/s^2) with gravity, damping and air drag at velocity v.
void forces_to_accelerations(const OuterForces& outer, const std::vector<double>& area_m2,
                             const std::vector<double>& inverse_mass, const Field& v, Field& a);

/// Per particle the square of its speed.
void squared_speeds(const Field& v, std::vector<double>& result);

}  // namespace drape::sim
