// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "simulate/mesh/descent.hpp"

namespace drape::simulate {

struct TimeStepsOptions {
  double step_s = 4e-3;       ///< the first step
  double longest_step_s = 0;  ///< steps double up to it while no point goes far; 0: all alike
  double drag_per_s = 4;      ///< beta / m of the air's F = -beta v, as there
  double quiet_m = 10e-6;     ///< kinetic energy over weight, as there, of a cloth at rest ...
  double quiet_s = 0.1;       ///< ... for so long: cloth that turns has none for a moment
  double longest_s = 5;       ///< time of motion after `least_s` at which it ends, not quiet
  /// Residual of each step, in mean weights of a point: what it leaves is an error of the
  /// acceleration of so many g.
  double residual = 1e-2;
  /// Displacement of a point in a step, in mean sides, above which steps are not longer than the
  /// first.
  double farthest = 0.2;
};

struct TimeStepsReport {
  bool quiet = false;
  double time_s = 0;
  int increments = 0;  ///< steps in time, at each of which friction settled
  int hurried = 0;     ///< steps that ended above their residual
  int steps = 0;       ///< steps of descents
};

using Carry = std::function<void(double time_s, MeshCloth::State& state)>;

/// Motion of cloth from rest, by backward differences of second order (Curtiss and Hirschfelder
/// 1952; the first step is Euler's), in steps whose length may double or halve. Each step goes down
/// the energy with the inertia of the true masses: while steps are short beside the growth of any
/// fold this has one minimum, and friction, which settles once per step, follows the cloth's motion
/// and not the descent's. `table_z_m` gives the table's height at a time; the motion does not end
/// before `least_s`; `pushes` may be absent, and so may `carry`, which puts what is held to its
/// place at a time.
[[nodiscard]] TimeStepsReport move_in_time(MeshCloth& cloth, MeshCloth::State& state,
                                           const std::vector<bool>& held, MeshStiffness& stiffness,
                                           Drapemeter bodies,
                                           const std::function<double(double)>& table_z_m,
                                           double least_s, DescentOptions descent,
                                           const TimeStepsOptions& options,
                                           Pushes* pushes = nullptr, const Carry& carry = {});

}  // namespace drape::simulate
