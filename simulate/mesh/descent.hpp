// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "simulate/mesh/mesh_cloth.hpp"
#include "simulate/mesh/mesh_stiffness.hpp"

namespace drape::simulate {

/// Supports that a drapemeter's cloth may meet, both without friction.
struct Drapemeter {
  double wall_radius_m = 0;  ///< an upright cylinder about the z axis below z = 0, cloth outside
  double table_z_m = -std::numeric_limits<double>::infinity();  ///< a horizontal pad
  double table_n_per_m3 = 0;  ///< its stiffness; 0: cloth sinks in by 0.5 mm under its own weight
};

/// Energy that a step in time adds: per point a spring to a place of its own, of so many
/// times its mass.
struct Inertia {
  MeshCloth::State towards;
  double per_s2 = 0;
};

/// Another push on the cloth, by an energy of its state.
class Pushes {
 public:
  virtual ~Pushes() = default;
  [[nodiscard]] virtual double energy_j(const MeshCloth::State& state) = 0;
  /// Adds minus the energy's gradient (N; N m for the sides).
  virtual void add_forces(const MeshCloth::State& state, MeshCloth::State& force) = 0;
  /// Stiffness between unknowns, for the matrix that preconditions a descent.
  [[nodiscard]] virtual std::vector<Support> supports(const MeshCloth::State& state) = 0;
  /// Adds the energy's second derivative times a direction. Contacts keep their state: pressed
  /// places stay pressed, sticking ones stick, sliding ones resist across their slip alone.
  virtual void add_products(const MeshCloth::State& state, const MeshCloth::State& direction,
                            MeshCloth::State& product) = 0;
  /// After an increment of load: takes it over into what holds by friction.
  virtual void settle(const MeshCloth::State& state) = 0;
  /// The part of the straight path between two states that cloth may go, 1 for all of it. `led`:
  /// nothing pushes it back there, as pins that are carried.
  [[nodiscard]] virtual double clear_part(const MeshCloth::State& /*from*/,
                                          const MeshCloth::State& /*to*/, bool /*led*/) {
    return 1;
  }
};

struct DescentOptions {
  int most_steps = 20000;
  /// Force left on a free point, in mean weights of a point; of a side, in those times the mean
  /// side.
  double residual = 1e-3;
  /// Also ends below this residual, where it is a quarter of that at its start: for one of several.
  double passing = 0;
  Eigen::Vector3d gravity_m_per_s2 = {0, 0, -9.80665};
  /// Longest step of a point, in mean sides. Short steps stay with the folds that are there; of
  /// 0.15, 0.3, 0.5 and 1 the one near the lowest energies for each of two fabrics, on 10 and 15
  /// mm.
  double farthest_step = 0.3;
  const Inertia* inertia = nullptr;
};

struct DescentReport {
  bool at_rest = false;
  int steps = 0;
  double residual = 0;      ///< as in the options, of points
  double energy_j = 0;      ///< internal and of height
  double dissipated_j = 0;  ///< by internal friction
};

/// Goes down the energy to a rest by Newton's method with Armijo's line search: each step solves
/// with the exact second derivative by conjugate gradients, which MeshStiffness preconditions, up
/// to a direction of negative curvature (Steihaug 1983).
/// A descent is one increment of load: internal friction and that of `pushes` keep the memory of
/// its start, so that there is one energy whatever a descent's steps are, and settle once, at the
/// end.
///
/// Wall and table push in proportion to depth: the table, where nothing else is said, so that cloth
/// sinks in by half a millimetre, for it only leads to a rest and is gone there; the wall by a
/// hundred weights of a mean point for 1e-5 of its radius, what lies on it for the checker.
/// `stiffness` is that of the same cloth and `held` unknowns, `pushes` may be absent.
[[nodiscard]] DescentReport descend(MeshCloth& cloth, MeshCloth::State& state,
                                    const std::vector<bool>& held, MeshStiffness& stiffness,
                                    const Drapemeter& bodies, const DescentOptions& options,
                                    Pushes* pushes = nullptr);

}  // namespace drape::simulate
