// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "simulate/simulate.hpp"
#include "simulate/validation/test_sheets.hpp"

namespace drape::simulate {

/// A closed form as anyone could run it: scene, print, fabric and start become files, which the
/// programs' readers read. SI; the files have people's units. Cells are square.
struct DoorCase {
  int rows = 0, cols = 3;
  double spacing_m = 0;
  double density_kg_per_m2 = 0.15;
  ForceCurve tensile{1500, {}};  ///< warp and weft
  double shear_n_per_m = 10, bending_n_m = 1e-5, twist_n_m = 1e-6;
  Eigen::Vector3d gravity_m_per_s2{0, 0, -kGravity};
  double friction = 0;
  double damping_per_s = SimulateOptions{}.damping_per_s;
  double table_z_m = -2;
  /// Where a particle starts; what is pinned is held there, or at `held_at`.
  std::function<Eigen::Vector3d(double u, double v)> start;
  bool starts_flat = false;  ///< with mode `flat`: start() must be flat_place()
  std::function<Eigen::Vector3d(double u, double v)> held_at;
  std::vector<int> pinned;    ///< particles
  std::vector<Clamp> clamps;  ///< about the case's own origin
  /// Largest residual by Runge-Kutta and by the fall, of a particle's weight.
  double motion_tolerance = 1e-4, static_tolerance = 1e-6;
  long motion_steps = 400000;

  [[nodiscard]] GridSpec grid() const {
    return {rows, cols, {spacing_m * (rows - 1), spacing_m * (cols - 1)}};
  }
  /// Where the start mode `flat` about the origin puts a material point.
  [[nodiscard]] Eigen::Vector3d flat_place(double u, double v) const {
    return {v - 0.5 * grid().patch_m.y(), 0.5 * grid().patch_m.x() - u, 0};
  }
};

/// Result of a run: the shape about the case's own origin, and whether solver and checker accept
/// it as at rest.
struct DoorRun {
  bool rests = false;
  std::string sentence;
  Field position;
  double stretch_j = 0, shear_j = 0;
};

/// Runs a case with its world moved to `origin`.
[[nodiscard]] DoorRun run_door_case(const DoorCase& the_case, Solver solver,
                                    const Eigen::Vector3d& origin);

/// One or more cases and what they say together.
struct DoorForm {
  std::string what;
  double exact = 0, goal = 0;  ///< goal: largest relative error
  std::vector<DoorCase> cases;
  std::function<double(const std::vector<DoorRun>& runs)> measure;  ///< in units of `exact`
  /// A run that does not rest or that the checker refuses misses the goal; else `measure` judges.
  bool all_must_rest = true;
};

/// The larger relative error with the origins 0 and (300, -200, 1000) mm; infinite, and a failure,
/// where a run that must rest does not.
[[nodiscard]] double worst_error(const DoorForm& form, Solver solver);
/// Expects each of the solvers "fall" and "rk4" to meet the form's goal.
void expect_form(const DoorForm& form);

}  // namespace drape::simulate
