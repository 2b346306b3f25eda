// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "simulate/mesh/mesh_cloth.hpp"
#include "simulate/mesh/mesh_stiffness.hpp"

namespace drape::simulate {

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
  /// Adds the negative gradient of the energy (N; N m for the sides).
  virtual void add_forces(const MeshCloth::State& state, MeshCloth::State& force) = 0;
  /// Stiffness between unknowns, for the preconditioner of a descent.
  [[nodiscard]] virtual std::vector<Support> supports(const MeshCloth::State& state) = 0;
  /// Adds the energy's second derivative times a direction. Contacts keep their state: pressed
  /// places stay pressed, sticking ones stick, sliding ones resist across their slip alone.
  virtual void add_products(const MeshCloth::State& state, const MeshCloth::State& direction,
                            MeshCloth::State& product) = 0;
  /// Called after a load increment: updates the state of friction.
  virtual void settle(const MeshCloth::State& state) = 0;
  /// Largest fraction of the straight path between two states that is free of penetration, at most
  /// 1. `led`: the motion is imposed, as by moving pins, so no force can undo a penetration.
  [[nodiscard]] virtual double clear_part(const MeshCloth::State& /*from*/,
                                          const MeshCloth::State& /*to*/, bool /*led*/) {
    return 1;
  }
};

struct DescentOptions {
  int most_steps = 20000;
  /// Largest net force on a free point, in mean weights of a point; for a side, in that unit times
  /// the mean side length.
  double residual = 1e-3;
  /// Accepts this residual too if it is a quarter of the initial one, for intermediate loads.
  double passing = 0;
  Eigen::Vector3d gravity_m_per_s2 = {0, 0, -9.80665};
  /// Longest step of a point, in mean side lengths. Short steps preserve existing folds; of 0.15,
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

/// Minimises the energy by Newton's method with Armijo line search: each step solves with the exact
/// second derivative by conjugate gradients, preconditioned by MeshStiffness, until a direction of
/// negative curvature (Steihaug 1983).
/// A descent is one load increment: internal friction and that of `pushes` keep the state of its
/// start, so that the energy does not depend on the path, and are updated once, at the end.
///
/// Wall and table push back in proportion to penetration. By default the cloth sinks into the table
/// by half a millimetre, since the table only guides it to a rest and is removed before that; the
/// wall gives way by 1e-5 of its radius under a hundred mean point weights, which the checker
/// accepts as touching. `stiffness` must belong to the same cloth and `held` unknowns; `pushes` may
/// be null.
[[nodiscard]] DescentReport descend(MeshCloth& cloth, MeshCloth::State& state,
                                    const std::vector<bool>& held, MeshStiffness& stiffness,
                                    const Drapemeter& bodies, const DescentOptions& options,
                                    Pushes* pushes = nullptr);

}  // namespace drape::simulate
