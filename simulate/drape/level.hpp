// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/mesh/time_steps.hpp"
#include "simulate/objects/contact_forces.hpp"
#include "simulate/objects/surroundings.hpp"
#include "simulate/start/clamps.hpp"
#include "simulate/start/local_frame.hpp"
#include "simulate/start/variation.hpp"

namespace drape::simulate {

/// Numerical options of a drape; SI.
struct DrapeOptions {
  double spacing_m = 2.5e-3;  ///< spacing of the finest mesh
  double coarsest_m = 10e-3;  ///< spacing of the mesh on which the cloth falls
  unsigned seed = 1;          ///< chooses the jitter of each mesh's lattice
  /// Options of the fall, slow as in a thick fluid or from a hand that lays the cloth: by its drag
  /// free cloth falls at 0.25 m/s. Quiet: 0.4 mm/s.
  TimeStepsOptions motion = {
      .step_s = 8e-3, .longest_step_s = 64e-3, .drag_per_s = 40, .quiet_m = 1e-8, .longest_s = 10};
  DescentOptions descent;
  /// Layers of a cloth that else passes through itself press this far apart; 0: they do not press.
  double thickness_m = 0.5e-3;
};

/// Spacings of the meshes from coarse to fine: halved from the coarsest until the finest, which is
/// `options.spacing_m`. One where the finest is not below the coarsest.
[[nodiscard]] std::vector<double> level_spacings_m(const DrapeOptions& options);

/// A cloth and everything that is around it, in the frame of its sheet (start/local_frame.hpp).
struct DrapeCase {
  LocalScene local;  ///< scene and measured sheet in that frame, and the way back to the world
  Print print;
  ClothLaws laws;
  ClothOutline outline;  ///< in material coordinates (warp, weft) of the print's patch, m
  std::shared_ptr<const Surroundings> around;
  std::vector<Eigen::Vector3d> pins_at;  ///< places of the pins, in the order of the scene's
  std::vector<HeldLine> lines;           ///< lines that clamps hold
  std::optional<MaterialShape> shape;    ///< measured shape; only where the cloth starts from it
};

/// The case of a scene in the world; without an outline the cloth is the print's whole patch.
/// Throws Error(bad_input) for a pin or clamp beside the cloth, a start inside an object, and as
/// local_scene(), pin_places(), held_lines() and measured_shape().
[[nodiscard]] DrapeCase drape_case(const Scene& world, const Print& print,
                                   const std::optional<Sheet>& measured, ClothLaws laws,
                                   std::optional<ClothOutline> outline = std::nullopt);

/// Memory of contact: springs of friction and carried forces by material place, so that
/// another mesh of the same cloth can go on from them (drape/object_pushes.hpp, layer_pushes.hpp).
struct ContactMemory;

/// Everything that a cloth on one mesh is at a moment: whoever keeps it can go on from there.
struct ClothMoment {
  MeshCloth::State state;                        ///< points, then sides (mesh/mesh_cloth.hpp)
  ClothMemory memory;                            ///< internal friction
  std::shared_ptr<const ContactMemory> contact;  ///< absent: nothing pressed yet
  double layers_apart_m = 0;                     ///< 0: layers do not press
};

/// End of a fall or of a descent.
struct RestReport {
  bool at_rest = false;
  TimeStepsReport motion;  ///< of the fall; empty of a descent alone
  DescentReport descent;   ///< the last one
  int steps = 0;           ///< of all descents
  std::string why;         ///< not at rest: why
};

/// Extremes of a cloth's strains.
struct ClothStrains {
  double warp_least = 0, warp_most = 0, weft_least = 0, weft_most = 0, shear_most_rad = 0,
         curvature_most_per_m = 0;
};

/// The cloth of a case on one mesh, with what holds and touches it. Not thread safe; levels of one
/// case share nothing that changes.
class DrapeLevel {
 public:
  /// Meshes the outline with points on pins and sides on clamps. `drape` must outlive it.
  DrapeLevel(const DrapeCase& drape, const DrapeOptions& options, double spacing_m);
  ~DrapeLevel();
  DrapeLevel(const DrapeLevel&) = delete;
  DrapeLevel& operator=(const DrapeLevel&) = delete;

  [[nodiscard]] const DrapeCase& drape() const;
  [[nodiscard]] const MeshCloth& cloth() const;
  [[nodiscard]] double spacing_m() const;
  [[nodiscard]] const std::vector<bool>& held() const;   ///< by unknown
  [[nodiscard]] const std::vector<int>& pinned() const;  ///< points, in the order of scene.pins
  [[nodiscard]] const std::vector<Eigen::Vector3d>& pinned_at() const;  ///< places of these points
  [[nodiscard]] double mass_kg() const;

  /// The scene's start: flat, from where fall() carries pins and clamps to their places, or the
  /// measured shape with pins and clamps in place.
  [[nodiscard]] ClothMoment start(const StartVariation& variation = {}) const;
  /// The start that any other shape gives: places (local frame) of material points, not all on a
  /// line; what they do not cover is continued (drape/smooth_surface.hpp). Pins and clamps are in
  /// place.
  [[nodiscard]] ClothMoment start_at(const std::vector<Eigen::Vector2d>& material_m,
                                     const std::vector<Eigen::Vector3d>& places) const;
  /// A rest of the same cloth on another mesh, carried to this one with friction and memory.
  [[nodiscard]] ClothMoment carried(const DrapeLevel& from, const ClothMoment& rest) const;

  /// Gravity of what follows (m/s^2, local frame), and friction; the scene's at first. For pushes
  /// and variations.
  void set_gravity(const Eigen::Vector3d& gravity_m_per_s2);
  void set_friction(double coefficient);

  /// Lets the cloth fall in time from a moment until it is quiet, then takes it down to rest. A
  /// scene's pins and clamps are carried to their places meanwhile.
  RestReport fall(ClothMoment& moment, const StartVariation& variation = {});
  /// Takes the cloth down to rest from where it is, friction settling at the end of each descent.
  /// `residual`: at which it ends, in mean weights of a point; absent: the options'.
  RestReport rest(ClothMoment& moment, std::optional<double> residual = std::nullopt);

  /// Internal, gravity and contact energy (J); gravity about the local origin.
  [[nodiscard]] double energy_j(const ClothMoment& moment) const;
  /// Nodes of the surface: the points, then a place in the middle of each side (mesh/surface.hpp).
  [[nodiscard]] MeshCloth::State surface(const ClothMoment& moment) const;
  /// Places (local frame) of material points, one row each. NaN beside the cloth.
  [[nodiscard]] Eigen::MatrixX3d places(const ClothMoment& moment,
                                        const std::vector<Eigen::Vector2d>& material_m) const;
  /// Forces of objects, then of layers, on nodes of the surface.
  [[nodiscard]] std::vector<ContactForce> contact_forces(const ClothMoment& moment) const;
  [[nodiscard]] ClothStrains strains(const ClothMoment& moment) const;
  [[nodiscard]] bool meets_itself(const ClothMoment& moment) const;

  /// Net force on the unknowns (N; N m for sides): internal, gravity and contact. Surroundings are
  /// those that the case has at the call.
  [[nodiscard]] MeshCloth::State forces(const ClothMoment& moment) const;

  /// Displacement (of all unknowns, in their units) that a small change of the forces (N; N m for
  /// sides) leads to: H dx = df, by conjugate gradients on exact products of the second derivative
  /// (pressed places stay pressed, sticking ones stick, sliding ones follow), with the factor as
  /// preconditioner. Nothing where H is not positive definite.
  [[nodiscard]] std::optional<MeshCloth::State> first_order(const ClothMoment& rest,
                                                            const MeshCloth::State& force_change);
  /// The same for several changes.
  [[nodiscard]] std::optional<std::vector<MeshCloth::State>> first_order(
      const ClothMoment& rest, const std::vector<MeshCloth::State>& force_changes);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace drape::simulate
