// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "simulate/mesh/descent.hpp"

namespace drape::simulate {

struct TimeStepsOptions {
  double step_s = 4e-3;       ///< initial step
  double longest_step_s = 0;  ///< steps may double up to this while no point moves far; 0: never
  double drag_per_s = 4;      ///< beta / m of the air drag F = -beta v
  double quiet_m = 10e-6;     ///< kinetic energy over weight below which the cloth is quiet ...
  double quiet_s = 0.1;       ///< ... if for so long, since it vanishes for a moment at a reversal
  double longest_s = 5;  ///< limit of the motion after `least_s`; it then ends, though not quiet
  /// Residual of each step, in mean weights of a point: the acceleration has an error of so many
  /// g.
  double residual = 1e-2;
  /// Displacement of a point per step, in mean side lengths, above which steps return to the
  /// initial length.
  double farthest = 0.2;
};

struct TimeStepsReport {
  bool quiet = false;
  double time_s = 0;
  int increments = 0;  ///< time steps, each with one update of friction
  int hurried = 0;     ///< steps that ended above their residual
  int steps = 0;       ///< descent steps
};

using Carry = std::function<void(double time_s, MeshCloth::State& state)>;

/// Integrates the motion of cloth from rest by second-order backward differences (Curtiss and
/// Hirschfelder 1952; the first step is Euler's), with steps that can double or halve. Each step
/// minimises the energy including inertia: if steps are short compared with the growth of any fold,
/// the minimum is unique, and friction, updated once per step, follows the motion of the cloth and
/// not that of the descent. `table_z_m` gives the height of the table over time; the motion lasts
/// at least `least_s`. `pushes` and `carry` may be absent; `carry` moves held unknowns to their
/// place at a time.
[[nodiscard]] TimeStepsReport move_in_time(MeshCloth& cloth, MeshCloth::State& state,
                                           const std::vector<bool>& held, MeshStiffness& stiffness,
                                           Drapemeter bodies,
                                           const std::function<double(double)>& table_z_m,
                                           double least_s, DescentOptions descent,
                                           const TimeStepsOptions& options,
                                           Pushes* pushes = nullptr, const Carry& carry = {});

}  // namespace drape::simulate
