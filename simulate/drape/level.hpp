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

/// Numerical options of a drape, in SI units.
struct DrapeOptions {
  double spacing_m = 2.5e-3;  ///< spacing of the finest mesh
  double coarsest_m = 10e-3;  ///< spacing of the mesh used for the fall
  unsigned seed = 1;          ///< seed for the jitter of each mesh's lattice
  /// Options of the fall, which is slow, as in a viscous fluid or when laid by hand: the drag lets
  /// free cloth fall at 0.25 m/s. Quiet means 0.4 mm/s.
  TimeStepsOptions motion = {
      .step_s = 8e-3, .longest_step_s = 64e-3, .drag_per_s = 40, .quiet_m = 1e-8, .longest_s = 10};
  DescentOptions descent;
  /// Distance that layers keep if the cloth would otherwise pass through itself; 0: no repulsion.
  double thickness_m = 0.5e-3;
};

/// Spacings of the meshes from coarse to fine: halved from the coarsest down to the finest,
/// `options.spacing_m`. A single one if the finest is not below the coarsest.
[[nodiscard]] std::vector<double> level_spacings_m(const DrapeOptions& options);

/// A cloth with its surroundings, in the frame of its sheet (start/local_frame.hpp).
struct DrapeCase {
  LocalScene local;  ///< scene and measured sheet in that frame, with the transform to the world
  Print print;
  ClothLaws laws;
  ClothOutline outline;  ///< in material coordinates (warp, weft) of the print's patch, m
  std::shared_ptr<const Surroundings> around;
  std::vector<Eigen::Vector3d> pins_at;  ///< positions of the pins in the order of the scene
  std::vector<HeldLine> lines;           ///< lines held by clamps
  std::optional<MaterialShape> shape;    ///< measured shape, if the cloth starts from it
};

/// Makes the case of a scene given in the world; without an outline the cloth is the print's whole
/// patch. Throws Error(bad_input) for a pin or clamp outside the cloth, a start inside an object,
/// and like local_scene(), pin_places(), held_lines() and measured_shape().
[[nodiscard]] DrapeCase drape_case(const Scene& world, const Print& print,
                                   const std::optional<Sheet>& measured, ClothLaws laws,
                                   std::optional<ClothOutline> outline = std::nullopt);

/// State of contact: friction springs and forces by material place, with which another mesh of the
/// same cloth can continue (drape/object_pushes.hpp, layer_pushes.hpp).
struct ContactMemory;

/// Complete state of a cloth on one mesh, from which a drape can continue.
struct ClothMoment {
  MeshCloth::State state;                        ///< points, then sides (mesh/mesh_cloth.hpp)
  ClothMemory memory;                            ///< state of internal friction
  std::shared_ptr<const ContactMemory> contact;  ///< null before the first contact
  double layers_apart_m = 0;                     ///< distance that layers keep; 0 without repulsion
};

/// Result of a fall or a relaxation to rest.
struct RestReport {
  bool at_rest = false;
  TimeStepsReport motion;  ///< the fall; empty for a relaxation only
  DescentReport descent;   ///< the last descent
  int steps = 0;           ///< sum over all descents
  std::string why;         ///< reason if not at rest
};

/// Extreme strains of a cloth.
struct ClothStrains {
  double warp_least = 0, warp_most = 0, weft_least = 0, weft_most = 0, shear_most_rad = 0,
         curvature_most_per_m = 0;
};

/// The cloth of a case on one mesh, with its holds and contacts. Not thread-safe; levels of one
/// case share no mutable state.
class DrapeLevel {
 public:
  /// Meshes the outline, with points at pins and mesh sides along clamps. `drape` must outlive it.
  DrapeLevel(const DrapeCase& drape, const DrapeOptions& options, double spacing_m);
  ~DrapeLevel();
  DrapeLevel(const DrapeLevel&) = delete;
  DrapeLevel& operator=(const DrapeLevel&) = delete;

  [[nodiscard]] const DrapeCase& drape() const;
  [[nodiscard]] const MeshCloth& cloth() const;
  [[nodiscard]] double spacing_m() const;
  [[nodiscard]] const std::vector<bool>& held() const;   ///< per unknown
  [[nodiscard]] const std::vector<int>& pinned() const;  ///< mesh points in the order of scene.pins
  [[nodiscard]] const std::vector<Eigen::Vector3d>& pinned_at() const;  ///< where these points are
  [[nodiscard]] double mass_kg() const;

  /// The scene's start: flat, with pins and clamps still to be moved to their places by fall(), or
  /// the measured shape with pins and clamps in place.
  [[nodiscard]] ClothMoment start(const StartVariation& variation = {}) const;
  /// Start with another shape, given by positions (local frame) of material points that are not
  /// all collinear, extrapolated elsewhere (drape/smooth_surface.hpp). Pins and clamps are in
  /// place.
  [[nodiscard]] ClothMoment start_at(const std::vector<Eigen::Vector2d>& material_m,
                                     const std::vector<Eigen::Vector3d>& places) const;
  /// Transfers a rest of the same cloth from another mesh to this one, with friction and memory.
  [[nodiscard]] ClothMoment carried(const DrapeLevel& from, const ClothMoment& rest) const;

  /// Sets gravity (m/s^2, local frame) or friction from here on; initially those of the scene. For
  /// pushes and variations.
  void set_gravity(const Eigen::Vector3d& gravity_m_per_s2);
  void set_friction(double coefficient);

  /// Lets the cloth fall in time until it is quiet, then relaxes it to rest. Pins and clamps are
  /// moved to their places meanwhile.
  RestReport fall(ClothMoment& moment, const StartVariation& variation = {});
  /// Relaxes the cloth to rest from its state, updating friction at the end of each descent.
  /// `residual`, in mean weights of a point, ends it; absent means that of the options.
  RestReport rest(ClothMoment& moment, std::optional<double> residual = std::nullopt);

  /// Internal plus gravity plus contact energy (J); gravity relative to the local origin.
  [[nodiscard]] double energy_j(const ClothMoment& moment) const;
  /// Nodes of the surface: the points, then the midpoint of each side (mesh/surface.hpp).
  [[nodiscard]] MeshCloth::State surface(const ClothMoment& moment) const;
  /// Positions (local frame) of material points, one row each; NaN outside the cloth.
  [[nodiscard]] Eigen::MatrixX3d places(const ClothMoment& moment,
                                        const std::vector<Eigen::Vector2d>& material_m) const;
  /// Contact forces of objects, then of layers, on nodes of the surface.
  [[nodiscard]] std::vector<ContactForce> contact_forces(const ClothMoment& moment) const;
  [[nodiscard]] ClothStrains strains(const ClothMoment& moment) const;
  [[nodiscard]] bool meets_itself(const ClothMoment& moment) const;

  /// Net force on the unknowns (N; N m for sides): internal, gravity and contact. Uses the case's
  /// surroundings at the time of the call.
  [[nodiscard]] MeshCloth::State forces(const ClothMoment& moment) const;

  /// First-order displacement of all unknowns, in their units, due to a small change of the forces
  /// (N; N m for sides): solves H dx = df by conjugate gradients on exact products of the second
  /// derivative (pressed places stay pressed, sticking ones stick, sliding ones slide), with the
  /// factor as preconditioner. nullopt if H is not positive definite.
  [[nodiscard]] std::optional<MeshCloth::State> first_order(const ClothMoment& rest,
                                                            const MeshCloth::State& force_change);
  /// Same, for several changes.
  [[nodiscard]] std::optional<std::vector<MeshCloth::State>> first_order(
      const ClothMoment& rest, const std::vector<MeshCloth::State>& force_changes);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace drape::simulate
