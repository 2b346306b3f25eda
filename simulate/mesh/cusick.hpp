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
  /// Without internal friction: steps in which a table at the discs' height, on which the specimen
  /// lies, is lowered by the width of the free ring, with the cloth nearly at rest at each; the
  /// last frees it. 1 releases it at once, which leaves too many folds, the fastest growing ones.
  int lowering_steps = 8;
  /// With internal friction: duration of the lowering, with the cloth in motion, because the
  /// resulting rest depends on the whole history. 0 releases it at once.
  double lowering_s = 0.5;
  TimeStepsOptions motion;
  /// Spacing of a coarser mesh for the lowering, in units of `spacing_m`; shape and friction are
  /// then transferred to the mesh itself, which goes to rest. 1 uses the mesh itself, and so does a
  /// free ring narrower than six spacings, which would be too coarse for its folds.
  double laid_coarser = 4.0 / 3;
  /// Load history before the last rest: number of cycles between rests under (1 + shake) and (1 -
  /// shake) times gravity, each one load increment. Without internal friction it only affects which
  /// rest is reached.
  int shakes = 0;
  double shake = 0.5;
  /// Limits of steps and residual per load; a load before the last whose residual stays above 1 is
  /// accepted and counted.
  DescentOptions descent;
};

struct CusickDrape {
  MaterialMesh mesh;
  MeshCloth::State state;  ///< points, then sides
  ClothMemory memory;      ///< internal friction at this rest
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
