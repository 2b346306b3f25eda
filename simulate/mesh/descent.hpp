// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

/// A stiffness (N/m) between two points of a triangle, or of one point; each pair `point`, `other`
/// occurs once. For an edge (N m), both are its unknown.
struct Support {
  int point = 0, other = 0;
  Eigen::Matrix3d stiffness;
};

/// A symmetric positive definite approximation of the Hessian of a MeshCloth's energy, with its
/// Cholesky factor: the preconditioner of a descent.
///
/// The membrane part contains the products of first derivatives and the tension of each triangle,
/// not its compression. Bending depends on the points only; the edges' derivatives come from the
/// linear triangles on both sides, weighted so that a bend across the edge is exact. At the hem,
/// where nothing holds an edge, they minimise the triangle's own energy. A second matrix, of the
/// edges alone, covers the deviation of the edges' derivatives from these, with the seams and the
/// supports of edges, using the stiffness of elements before slip.
class MeshStiffness {
 public:
  /// `held` unknowns are fixed. Both arguments must outlive this object.
  MeshStiffness(const MeshCloth& cloth, const std::vector<bool>& held);
  ~MeshStiffness();
  MeshStiffness(const MeshStiffness&) = delete;
  MeshStiffness& operator=(const MeshStiffness&) = delete;

  /// Forms and factorises the matrix of a state with `supports`. Returns false if rounding makes it
  /// indefinite.
  [[nodiscard]] bool factorise(const MeshCloth::State& state, const std::vector<Support>& supports);
  /// True if the last factor is still usable: no point has moved farther than `near_m` since.
  [[nodiscard]] bool serves(const MeshCloth::State& state, double near_m) const;
  void outdate() { formed_at_.clear(); }
  /// Solves in place; gives zero for held unknowns.
  void solve(MeshCloth::State& b) const;

 private:
  class Weights;
  struct Gradient;
  class SidesMatrix;
  struct Parts;
  std::unique_ptr<Parts> parts_;
  MeshCloth::State formed_at_;  ///< empty if none was formed
};

/// Result of conjugate_gradients().
struct ConjugateGradients {
  int products = 0;
  bool solved = false;
  bool positive = true;  ///< no direction of negative curvature was met
};

/// Solves H x = b approximately by conjugate gradients (Hestenes and Stiefel 1952) with the factor
/// as preconditioner, in at most `most` products. Stops once `solved` accepts the residual b - H x
/// and its norm in the factor's metric, relative to that of b; or at the first direction of
/// negative curvature (Steihaug 1983), with the x reached so far, or with that direction in the
/// first iteration. `multiply` sets the product of H and a direction; `b` returns the residual.
[[nodiscard]] ConjugateGradients conjugate_gradients(
    const MeshStiffness& factor,
    const std::function<void(const MeshCloth::State& direction, MeshCloth::State& product)>&
        multiply,
    const std::function<bool(double norm, const MeshCloth::State& residual)>& solved, int most,
    MeshCloth::State& b, MeshCloth::State& x);

/// Frictionless supports of the cloth in a drapemeter.
struct Drapemeter {
  double wall_radius_m = 0;  ///< vertical cylinder about the z axis below z = 0, cloth outside
  double table_z_m = -std::numeric_limits<double>::infinity();  ///< a horizontal elastic table
  double table_n_per_m3 = 0;  ///< its stiffness; 0: cloth sinks by 0.5 mm under its own weight
};

/// Energy of a time step: a spring from each point to a target position, with stiffness `per_s2`
/// times its mass.
struct Inertia {
  MeshCloth::State towards;
  double per_s2 = 0;
};

/// Interface for external forces with a potential energy.
class Pushes {
 public:
  virtual ~Pushes() = default;
  [[nodiscard]] virtual double energy_j(const MeshCloth::State& state) = 0;
  /// Adds the negative gradient of the energy (N; N m for the edges).
  virtual void add_forces(const MeshCloth::State& state, MeshCloth::State& force) = 0;
  /// Stiffness between unknowns, for the preconditioner of a descent.
  [[nodiscard]] virtual std::vector<Support> supports(const MeshCloth::State& state) = 0;
  /// Adds the energy's second derivative times a direction. Contacts keep their state: pressed
  /// points stay pressed, sticking points stick, sliding points resist across their slip alone.
  virtual void add_products(const MeshCloth::State& state, const MeshCloth::State& direction,
                            MeshCloth::State& product) = 0;
  /// Called after a load increment: updates the state of friction.
  virtual void settle(const MeshCloth::State& state) = 0;
  /// Largest fraction of the straight path between two states that is free of penetration, at most
  /// 1. `led`: the motion is imposed, as by moving pins, so that no force can undo a penetration.
  [[nodiscard]] virtual double clear_part(const MeshCloth::State& /*from*/,
                                          const MeshCloth::State& /*to*/, bool /*led*/) {
    return 1;
  }
};

struct DescentOptions {
  int most_steps = 20000;
  /// Largest net force on a free point, in mean weights of a point; for an edge, in that unit times
  /// the mean edge length.
  double residual = 1e-3;
  /// Accepts this residual too if it is a quarter of the initial one, for intermediate loads.
  double passing = 0;
  Eigen::Vector3d gravity_m_per_s2 = {0, 0, -9.80665};
  /// Longest step of a point, in mean edge lengths. Short steps preserve existing folds: of 0.15,
  /// 0.3, 0.5 and 1, this one came nearest to the lowest energies for two fabrics, on 10 and 15
  /// mm.
  double farthest_step = 0.3;
  const Inertia* inertia = nullptr;
};

struct DescentReport {
  bool at_rest = false;
  int steps = 0;
  double residual = 0;      ///< largest of the points, as in the options
  double energy_j = 0;      ///< internal plus gravity
  double dissipated_j = 0;  ///< dissipated by internal friction
};

/// Minimises the energy by Newton's method with Armijo line search. Each step solves with the exact
/// Hessian by conjugate gradients, preconditioned by MeshStiffness, until a direction of negative
/// curvature (Steihaug 1983). A descent is one load increment: internal friction and that of
/// `pushes` keep their initial state, so that the energy does not depend on the path, and are
/// updated once, at the end.
///
/// Wall and table push back in proportion to penetration. By default the cloth sinks into the table
/// by half a millimetre, since the table only guides it to equilibrium and is removed before the
/// last descent. The wall yields by 1e-5 of its radius under a hundred mean point weights, which
/// the checker accepts as touching. `stiffness` must belong to the same cloth and `held` unknowns;
/// `pushes` may be null.
[[nodiscard]] DescentReport descend(MeshCloth& cloth, MeshCloth::State& state,
                                    const std::vector<bool>& held, MeshStiffness& stiffness,
                                    const Drapemeter& bodies, const DescentOptions& options,
                                    Pushes* pushes = nullptr);

struct TimeStepsOptions {
  double step_s = 4e-3;       ///< initial step
  double longest_step_s = 0;  ///< steps may double up to this while no point moves far; 0: never
  double drag_per_s = 4;      ///< beta / m of the air drag F = -beta v
  double quiet_m = 10e-6;     ///< kinetic energy over weight below which the cloth is quiet ...
  double quiet_s = 0.1;       ///< ... for at least this long, since it also vanishes at a reversal
  double longest_s = 5;       ///< limit of the motion after `least_s`, quiet or not
  /// Residual of each step, in mean weights of a point: the error of the acceleration in
  /// g.
  double residual = 1e-2;
  /// Displacement of a point per step, in mean edge lengths, above which steps return to the
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
/// Hirschfelder 1952; the first step is backward Euler) with steps that double or halve. Each step
/// minimises the energy including inertia. If steps are short compared with the growth of any fold,
/// the minimum is unique; friction, updated once per step, then follows the motion of the cloth,
/// not that of the descent. `table_z_m` gives the height of the table over time; the motion lasts
/// at least `least_s`. `pushes` and `carry` may be absent; `carry` moves held unknowns to their
/// positions at a given time.
[[nodiscard]] TimeStepsReport move_in_time(MeshCloth& cloth, MeshCloth::State& state,
                                           const std::vector<bool>& held, MeshStiffness& stiffness,
                                           Drapemeter bodies,
                                           const std::function<double(double)>& table_z_m,
                                           double least_s, DescentOptions descent,
                                           const TimeStepsOptions& options,
                                           Pushes* pushes = nullptr, const Carry& carry = {});

}  // namespace drape::simulate
