// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/scene.hpp"
#include "simulate/dynamics/motion.hpp"
#include "simulate/objects/surroundings.hpp"
#include "simulate/simulate.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {

/// One run of Runge-Kutta: the motion and what is known about it so far.
class MotionRun {
 public:
  MotionRun(Cloth& cloth, const Surroundings& surroundings, const Scene& scene,
            const SimulateOptions& options)
      : cloth_(cloth),
        surroundings_(surroundings),
        options_(options),
        motion_(cloth, surroundings,
                {scene.gravity_m_per_s2, options.damping_per_s, options.air_drag_kg_per_m3,
                 scene.friction, options.contact_between_particles, options.cloth_thickness_m}),
        weight_n_(cloth.total_mass_kg() * scene.gravity_m_per_s2.norm()) {}

  void start(const StartState& state, bool relaxed, SimulateReport& report);
  void go(SimulateResult& result);
  /// Replaces gravity; what that adds to the energy counts as there from the start.
  void load(const Eigen::Vector3d& gravity_m_per_s2, SimulateReport& report);

  [[nodiscard]] const Field& position() const { return motion_.position; }
  [[nodiscard]] const Motion& motion() const { return motion_; }

 private:
  [[nodiscard]] bool quiet() const;
  [[nodiscard]] bool rests();
  void damp_kinetically(double step_s, SimulateReport& report);
  void damp_more(SimulateReport& report);
  void place_pins();
  void note(SimulateResult& result);
  void certify(SimulateReport& report);
  [[nodiscard]] double total_energy_j() const;

  Cloth& cloth_;
  const Surroundings& surroundings_;
  const SimulateOptions& options_;
  Motion motion_;
  std::vector<Hold> holds_;
  std::vector<Eigen::Vector3d> hold_in_world_;
  double weight_n_;
  double time_s_ = 0, pins_placed_s_ = 0, damped_from_s_ = 0, smooth_kinetic_j_ = 0;
  double next_note_s_ = 0;
  bool rising_ = false;
  bool damped_more_ = false;
};

/// Measures how far the sheet is from the objects, or deep in them: at and between its particles.
void measure_gaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                  SimulateReport& report);

/// Reports what the sheet does that cloth cannot: it is said, and such a sheet is not called at
/// rest.
void judge_overlaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                    const SimulateOptions& options, SimulateReport& report);

/// Warns where the cloth leaves a clamp at a large angle to the clamp's direction: its bend is then
/// within one grid spacing. Folded back it is refused by the checker.
void judge_clamps(const Scene& scene, const GridSpec& grid, const Sheet& sheet,
                  SimulateReport& report);

}  // namespace drape::simulate
