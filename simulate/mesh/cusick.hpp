// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "simulate/mesh/descent.hpp"
#include "simulate/mesh/mesh_cloth.hpp"
#include "simulate/mesh/time_steps.hpp"

namespace drape::simulate {

/// A drapemeter with a clamping disc: a round specimen held flat between two discs.
struct CusickOptions {
  double disc_m = 0.180, specimen_m = 0.300;
  double spacing_m = 0.0075;  ///< spacing of the mesh; a third of it at the discs' rim
  double warp_rad = 0;        ///< from the mesh lattice's first axis to the warp
  unsigned start = 1;         ///< chooses the lattice's jitter and the first waves
  /// The specimen lies on a table at the height of the discs, which goes down by the width of the
  /// free ring. Without internal friction, in so many steps, the cloth nearly at rest at each; the
  /// last frees it. 1: let go at once; its folds are then those that grow fastest, too many.
  int lowering_steps = 8;
  /// With internal friction, in so many seconds, the cloth in motion, because which rest remains
  /// depends on all that it went through. 0: let go at once.
  double lowering_s = 0.5;
  TimeStepsOptions motion;
  /// Spacing of the mesh on which it is laid, in spacings; shape and friction are then carried to
  /// the mesh itself and rest there. It is laid on the mesh itself where this is 1 or the free ring
  /// would be less than six spacings wide, too few for its folds.
  double laid_coarser = 4.0 / 3;
  /// Load history before the last rest: so often to rest under (1 + shake) and (1 - shake) times
  /// gravity, each one increment of load. Without internal friction it changes no rest but the
  /// choice of one.
  int shakes = 0;
  double shake = 0.5;
  /// Steps and residual are each load's; a load before the last that does not reach 1 goes on and
  /// is counted.
  DescentOptions descent;
};

struct CusickDrape {
  MaterialMesh mesh;
  MeshCloth::State state;  ///< points, then sides
  ClothMemory memory;      ///< state of internal friction, at this rest
  DescentReport report;
  /// Loads before the last at which it did not come near rest, among them steps of a motion.
  int hurried_loads = 0;
  double moved_s = 0;  ///< time of its motion; 0: none
};
/// Starts flat, with waves of 2 to 16 folds of random phase and 0.2 mm at the hem, on the table.
[[nodiscard]] CusickDrape cusick_drape(const ClothLaws& laws, const CusickOptions& options);

/// ASCII PLY in mm, z up, warp along x.
[[nodiscard]] std::string ply_text(const CusickDrape& drape);

}  // namespace drape::simulate
