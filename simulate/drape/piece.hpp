// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/mesh/time_steps.hpp"
#include "simulate/objects/contact_forces.hpp"

namespace drape::simulate {

struct PieceOptions {
  double spacing_m = 0.005;  ///< spacing of the mesh
  unsigned seed = 1;         ///< chooses the lattice's jitter
  /// Options of the fall, slow as in a thick fluid or from a hand that lays the cloth: by its drag
  /// free cloth falls at 0.25 m/s. Quiet: 0.4 mm/s.
  TimeStepsOptions motion = {.step_s = 8e-3, .drag_per_s = 40, .quiet_m = 1e-8, .longest_s = 10};
  DescentOptions descent;
  /// Layers of a piece that else passes through itself press this far apart, as on the particle
  /// grid; 0: they do not press.
  double cloth_thickness_m = 0.5e-3;
};

/// A piece of cloth on a triangle mesh, draped over the objects of a scene.
struct PieceDrape {
  MaterialMesh mesh;  ///< (warp, weft) of the print's patch
  MeshCloth::State state;
  MeshCloth::State surface;  ///< points, then the middle of each side (mesh/surface.hpp)
  ClothMemory memory;
  std::vector<int> pinned;  ///< points of the mesh, in the order of the scene's pins
  std::vector<Eigen::Vector3d> pinned_in_world;
  /// Forces of objects by the corners of triangles, whose places stand on the surface; the fourth
  /// has no weight. Of cloth on cloth by points of the surface, the second layer's weights
  /// negative.
  std::vector<ContactForce> contact_forces;
  double layers_apart_m = 0;  ///< that it fell with; 0: its layers did not press
  TimeStepsReport motion;     ///< before the descents to rest
  DescentReport report;       ///< the last of these
};

class ObjectPushes;

/// Lets a piece fall in time from its state, and takes it down to rest; then its points carry on
/// what presses them until none enters. Each descent is one increment, at whose end friction
/// settles: at rest nothing is left after that. `pushes` is among `all` that presses.
void fall_to_rest(MeshCloth& cloth, PieceDrape& piece, const std::vector<bool>& held,
                  ObjectPushes& pushes, Pushes& all, TimeStepsOptions motion,
                  const DescentOptions& descent);

/// Corners of the print's patch, for a piece that is all of it.
[[nodiscard]] ClothOutline outline_of(const Print& print);

/// Drapes a piece from flat, as the scene's start says ("flat" or "flat_from_measured"): it falls
/// in time, friction settling once per step, until it is quiet, then goes down its energy to rest
/// on objects and table (object_pushes.hpp), with the scene's Coulomb friction. Where that rest
/// passes through itself, it falls again with its layers apart (layer_pushes.hpp), without friction
/// between them. Pins hold points of the mesh. Throws
/// Error(bad_input) for a start from a measured shape, a pin beside the piece, and as make_start().
[[nodiscard]] PieceDrape drape_piece(const Scene& scene, const Print& print,
                                     const std::optional<Sheet>& measured, const ClothLaws& laws,
                                     ClothOutline outline, const PieceOptions& options);

/// ASCII PLY of the surface in mm, with texture coordinates u = warp, v = weft over the sides of
/// the patch.
[[nodiscard]] std::string ply_text(const PieceDrape& piece, const Eigen::Vector2d& patch_m);

}  // namespace drape::simulate
