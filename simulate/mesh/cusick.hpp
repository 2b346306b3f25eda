// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "simulate/mesh/descent.hpp"
#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

/// A drapemeter: a round specimen whose middle is clamped flat between two discs.
struct CusickOptions {
  double disc_m = 0.180, specimen_m = 0.300;
  double spacing_m = 0.0075;  ///< spacing of the mesh; a third of it at the rim of the discs
  double warp_rad = 0;        ///< angle from the first axis of the mesh lattice to the warp
  unsigned start = 1;         ///< seed of the lattice's jitter and of the initial waves
  /// Number of steps in which the table under the specimen, at the discs' height, is lowered by the
  /// width of the free ring, without internal friction. The cloth is nearly at rest after each; the
  /// last step frees it. 1 releases it at once and leaves too many folds, the fastest growing ones.
  int lowering_steps = 8;
  /// Duration of the lowering with internal friction, with the cloth in motion, since the final
  /// shape depends on the whole history. 0 releases it at once.
  double lowering_s = 0.5;
  TimeStepsOptions motion;
  /// Spacing of the coarser mesh used for the lowering, in units of `spacing_m`; shape and friction
  /// are then transferred to the fine mesh and relaxed. 1 uses one mesh throughout, and so does a
  /// free ring narrower than six spacings, which the coarser mesh would not resolve.
  double laid_coarser = 4.0 / 3;
  /// Load history before the last equilibrium: number of cycles between (1 + shake) and (1 - shake)
  /// times gravity, each one load increment. Without internal friction it only affects which
  /// equilibrium is reached.
  int shakes = 0;
  double shake = 0.5;
  /// Limits of steps and residual per load. An earlier load whose residual stays above 1 is
  /// accepted and counted.
  DescentOptions descent;
};

struct CusickDrape {
  MaterialMesh mesh;
  MeshCloth::State state;  ///< points, then edges
  ClothMemory memory;      ///< internal friction in this equilibrium
  DescentReport report;
  /// Loads before the last, or time steps, that ended far from rest.
  int hurried_loads = 0;
  double moved_s = 0;  ///< duration of the lowering motion; 0 if none
};
/// Drapes a specimen from flat on the table, with random waves of 2 to 16 folds and 0.2 mm at most.
[[nodiscard]] CusickDrape cusick_drape(const ClothLaws& laws, const CusickOptions& options);

/// ASCII PLY in mm, z up, warp along x.
[[nodiscard]] std::string ply_text(const CusickDrape& drape);

}  // namespace drape::simulate
