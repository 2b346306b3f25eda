// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "simulate/cloth/cloth.hpp"
#include "simulate/contact/layer_contacts.hpp"
#include "simulate/dynamics/motion.hpp"
#include "simulate/equilibrium/contacts.hpp"
#include "simulate/equilibrium/hessian.hpp"
#include "simulate/objects/surroundings.hpp"
#include "simulate/sparse/mixed_factor.hpp"

namespace drape::simulate {

/// When a sheet falls with its inertia, see StaticSolver::fall(). `where_stalled`: from where it
/// stalled on its path to rest, at most three times. `first`: before that too.
enum class Falls { never, where_stalled, first };

struct StaticOptions {
  Eigen::Vector3d gravity_m_per_s2{0, 0, -9.80665};
  double friction = 0;  ///< Coulomb coefficient
  bool contact_between_particles = true;
  /// Layers keep this apart; 0: the sheet passes through itself. Only where meets_itself is set.
  double cloth_thickness_m = 0;
  bool meets_itself = false;
  double residual_tolerance = 1e-6;  ///< in the mean particle's weight
  int max_iterations = 2000;         ///< per level
  int patience = 50;                 ///< iterations without progress, after which it stalls
  double first_step_s = 5e-3;        ///< pseudo-time step at the start
  bool paced = true;                 ///< short steps while the sheet falls, see StaticSolver
  bool only_a_start = false;         ///< ends at that residual, whatever gaps are left
  bool judge_stability = true;       ///< at rest; takes one factorisation in double precision
  int threads = 1;                   ///< for factors and second derivatives; never changes a result
  Falls falls = Falls::never;
  double longest_fall_step_s = 4e-3;
  double damping_per_s = 4;     ///< beta / m of F = -beta v while it falls
  double natural_time_s = 0.4;  ///< before velocities are zeroed at peaks of kinetic energy
  double fall_residual = 0.05;  ///< in the mean particle's weight, at which the fall ends
  double longest_fall_s = 20;
};

/// One Newton iteration.
struct StaticIteration {
  double pseudo_time_s = 0, residual = 0, gravity_j = 0, contact_j = 0;
  InternalEnergies inner;
  int touching = 0;
  [[nodiscard]] double sum_j() const { return gravity_j + contact_j + inner.sum_j(); }
};

/// `stalled`: as many iterations as it has patience for brought neither the residual nor the energy
/// down.
enum class StaticStatus { at_rest, iteration_limit, stalled, diverged };

struct StaticReport {
  StaticStatus status = StaticStatus::iteration_limit;
  int iterations = 0, factorisations = 0, indefinite = 0;
  int fell_on = 0;      ///< times that it stalled and fell on from there
  int reused = 0;       ///< solves with a factor of a matrix before
  double residual = 0;  ///< largest net force over the mean particle's weight
  double residual_rms = 0;
  bool stable = false;  ///< the exact Hessian on the free directions is positive definite
  double pin_error_m = 0, gap_error_m = 0;
  double longest_trial_m = 0;  ///< displacement of a particle, of all with layers on
  int touching = 0, between = 0;
  int layers = 0;                ///< pairs of pieces of the sheet that press on each other
  double cloth_thickness_m = 0;  ///< that layers kept apart; 0: the sheet did not meet itself
  bool through_itself = false;   ///< the fall ended at once, where the sheet passed through itself
  std::vector<ContactForce> contact_forces;  ///< in the frame of the solver
  std::vector<StaticIteration> history;
};

/// Finds an equilibrium of a sheet. Each iteration is a step of implicit pseudo-time (backward
/// Euler without inertia): one Newton iteration on the potential of cloth, gravity, contact and
/// friction plus mu / 2 times mass times displacement squared, taken only when it lowers that
/// potential. So the energy falls from step to step by at least what friction takes. mu falls as
/// the quadratic model proves true, to zero near the equilibrium, where this is Newton's method.
/// The exact Hessian is tried first, but in the first steps of a finer grid; where it is indefinite
/// the element-wise convex one takes its place. A step too long for its quadratic model is not cut
/// at once but iterated on, its springs pulling as the linear model says (see add_hessian()); so a
/// bent sheet is moved on by more than a tenth of a spacing. Late steps of a finer grid take
/// friction's limits from where they end.
class StaticSolver {
 public:
  StaticSolver(Cloth& cloth, const Surroundings& surroundings, const StaticOptions& options);

  Field position;  ///< blocks x, y, z (m)

  [[nodiscard]] Cloth& cloth() { return cloth_; }
  [[nodiscard]] const StaticOptions& options() const { return options_; }
  [[nodiscard]] StaticContacts& contacts() { return contacts_; }
  [[nodiscard]] const LayerContacts& layers() const { return layers_; }
  /// Takes `position` as a sheet at rest, to `reach_m` from the surfaces: contacts bear what the
  /// forces ask for.
  void rest_on_contacts(double reach_m);
  /// Lets the sheet fall from `position` with its inertia until it is nearly still. One that is
  /// taken to pass through itself, and does, falls no further: it has to meet itself.
  void fall(StaticReport& report);
  /// Goes to rest from `position`, falling as StaticOptions::falls says. Going to rest is one step
  /// of internal friction, in which no element turns back: fall() settles it at each of its own.
  StaticReport solve();
  /// The same to within `residual` of a weight, whatever gaps are left: on the path to a rest.
  StaticReport solve_nearly(double residual);
  /// StaticOptions::paced from here on; without it, a start near its rest takes far fewer steps.
  void pace(bool paced) { options_.paced = paced; }
  /// Changes gravity under a sheet at rest, which the next solve() follows from where it stands:
  /// contacts and friction keep what they hold.
  void load(const Eigen::Vector3d& gravity_m_per_s2);

  [[nodiscard]] double gravity_energy_j() const;
  /// First-order displacement of the sheet, x, y, z of each particle in turn, when `force` (N, in
  /// the same order) begins to act at the equilibrium. What slides and would be drawn back sticks,
  /// found by solving again until nothing changes; so the displacement for minus the force is
  /// another one. Nothing where the stiffness is not positive definite.
  [[nodiscard]] std::optional<Eigen::VectorXd> first_order_displacement(
      const Eigen::VectorXd& force);

 private:
  /// m; deeper entries are caught before a step is taken, and all after one in vain.
  static constexpr double kDeep = 1e-6;
  static constexpr double kNewtonMu = 1;  ///< 1/s^2; below, mu becomes 0
  void find_forces(const Field& x, Field& force) const;
  void add_outer_forces(const Field& x, Field& force) const;
  void release_pinned(Eigen::VectorXd& v) const;
  void fix_pinned();
  bool carry_pins(double most_m);
  void add_layers(const Field& x, bool convex);
  void begin_step();
  void begin_again(StaticContacts::Limits limits);
  bool factorise_here();
  bool factorise(bool convex);
  enum class Solve { again, changed };  ///< changed: once more, after review()
  void newton_matrix(bool convex);
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& product) const;
  bool find_step(StaticReport& report, Solve solve);
  bool solve_by_factor(StaticReport& report);
  bool solve_by_gradients(const Eigen::VectorXd& guess, StaticReport& report);
  [[nodiscard]] bool follows_pressing() const;
  bool solve_following(const Eigen::VectorXd& guess, StaticReport& report);
  void follow_pressing(double fraction);
  bool take_step(StaticReport& report);
  void cut_to_cap(Eigen::VectorXd& step) const;
  void move(const Field& from, const Eigen::VectorXd& displacement);
  double hold_back();
  double potential_change(const Eigen::VectorXd& displacement);
  void correct();
  [[nodiscard]] bool falling() const;
  [[nodiscard]] Eigen::Vector3d momentum_of(int i) const;
  void stretch(double predicted, double& ratio, Eigen::VectorXd& displacement);
  void improve(double predicted, double& ratio, Eigen::VectorXd& displacement);
  static double largest_of(const Eigen::VectorXd& displacement);
  [[nodiscard]] bool mixes() const;
  bool factorise_trial(StaticReport& report);
  void iterate(StaticReport& report, double predicted, double& ratio,
               Eigen::VectorXd& displacement);
  [[nodiscard]] Eigen::VectorXd displacement_to_trial() const;
  void plan_next(double ratio, bool whole);
  void note(StaticReport& report);
  [[nodiscard]] bool stagnates(const StaticReport& report);
  void go_to_rest(StaticReport& report);
  void finish(StaticReport& report);

  Cloth& cloth_;
  const Surroundings& surroundings_;
  StaticOptions options_;
  StaticContacts contacts_;
  LayerContacts layers_;
  GridMatrix hessian_;
  MixedFactor factor_;
  Field force_, trial_, trial_force_;
  Field momentum_;          ///< force that carries a falling sheet's momentum into a step (N)
  Field inner_force_;       ///< the sheet's own at `position`
  InternalEnergies inner_;  ///< and its energies
  Eigen::VectorXd step_, gradient_, model_gradient_, product_;
  std::vector<double> shift_;
  double weight_n_ = 0, mu_ = 0, residual_ = 0, pseudo_time_s_ = 0, cap_m_ = 0, moved_m_ = 0,
         longest_trial_m_ = 0;
  double best_residual_ = 0, best_j_ = 0,
         best_gap_m_ = 0;  ///< least values so far, and the iteration that found them
  int progress_at_ = 0;
  double drag_per_s2_ = 0, last_ratio_ = 0;
  double potential_j_ = 0, model_curve_ = 0, factor_mu_ = 0, last_residual_ = 0;
  SpringStrains strains_, trial_strains_;  ///< by the linear model of what led there
  bool factor_serves_ = false;             ///< factor_ is of a matrix like the present one
  bool convex_ = false;                    ///< and that matrix was the convex one
};

}  // namespace drape::simulate
