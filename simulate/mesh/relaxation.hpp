// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
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
/// along the push: its force must then point into the surface. A relaxation is one increment of
/// load: internal friction settles once, at the end, because fictitious masses move as no cloth.
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

}  // namespace drape::simulate
