// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

struct RelaxationOptions {
  int most_steps = 400000;
  double residual = 1e-3;  ///< largest force on a free point, in mean weights of a point
  Eigen::Vector3d gravity_m_per_s2 = {0, 0, -9.80665};
  double masses = 0.6;  ///< in parts of the stiffness bounds; 1/4 is the limit of stability
};

struct RelaxationReport {
  bool at_rest = false;
  int steps = 0;
  double residual = 0;      ///< as in the options
  double energy_j = 0;      ///< internal and of height
  double dissipated_j = 0;  ///< by internal friction
};

/// Dynamic relaxation (Day 1965; kinetic damping, Cundall 1976): fictitious masses of the unknowns'
/// stiffness bounds, velocities set to nothing whenever the kinetic energy falls. `held` unknowns
/// do not move; `project`, where given, puts a point back to the surface of what it may not enter
/// and returns whether it did. A point on a surface is pushed by it and not counted in the residual
/// along the push: its force must then point into the surface. Internal friction settles after each
/// step.
struct Contact {
  /// Outward normal where the point lies in or on the body (it is then moved to the surface).
  std::function<bool(Eigen::Vector3d& point, Eigen::Vector3d& normal)> project;
  /// Coulomb's coefficient. Friction takes from a point's velocity along the surface what it can
  /// bear, and the residual counts what is left of the point's force; which of the rests is found
  /// depends on the start.
  double friction = 0;
};
[[nodiscard]] RelaxationReport relax(MeshCloth& cloth, MeshCloth::State& state,
                                     const std::vector<bool>& held, const Contact& contact,
                                     const RelaxationOptions& options);

/// A drapemeter with a clamping disc: a round specimen held flat between two discs.
struct CusickOptions {
  double disc_m = 0.180, specimen_m = 0.300;
  double spacing_m = 0.0075;  ///< of the mesh; a third of it at the discs' rim
  double warp_rad = 0;        ///< from the mesh lattice's first axis to the warp
  unsigned start = 1;         ///< chooses the lattice's jitter and the first waves
  /// The specimen lies on a table at the height of the discs, which goes down by the width of the
  /// free ring in so many steps, the cloth nearly at rest at each; the last frees it. 1: let go at
  /// once; its folds are then those that grow fastest in the relaxation's own time, too many.
  int lowering_steps = 8;
  /// Load history before the last rest: so often to rest under (1 + shake) and (1 - shake) times
  /// gravity. Without internal friction it changes no rest but the choice of one.
  int shakes = 0;
  double shake = 0.5;
  /// Steps and residual are each load's; a load before the last that does not reach 1e-2 goes on
  /// and is counted.
  RelaxationOptions relaxation{.masses = 0.3};  ///< lighter and so faster: no Coulomb friction
};

struct CusickDrape {
  MaterialMesh mesh;
  MeshCloth::State state;  ///< points, then sides
  ClothMemory memory;      ///< of internal friction, at this rest
  RelaxationReport report;
  int hurried_loads = 0;  ///< loads before the last at which it did not come near rest
};
/// Starts flat, with waves of 2 to 16 folds of random phase and 0.2 mm at the hem, on the table.
[[nodiscard]] CusickDrape cusick_drape(const ClothLaws& laws, const CusickOptions& options);

/// ASCII PLY in mm, z up, warp along x.
[[nodiscard]] std::string ply_text(const CusickDrape& drape);

/// Corners of the outer border, in its order.
[[nodiscard]] std::vector<int> border_of(const MaterialMesh& mesh);

}  // namespace drape::simulate
