// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "core/simulation_files.hpp"
#include "simulate/mesh/descent.hpp"
#include "simulate/objects/cloth_files.hpp"
#include "simulate/objects/surroundings.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {

/// Numerical options of a drape, in SI units.
struct DrapeOptions {
  double spacing_m = 2.5e-3;  ///< spacing of the finest mesh
  double coarsest_m = 10e-3;  ///< spacing of the mesh used for the fall
  unsigned seed = 1;          ///< seed for the jitter of each mesh's lattice
  /// Options of the fall. It is slow, as in a viscous fluid or when laid by hand: with this drag
  /// free cloth falls at 0.25 m/s. The cloth is quiet at 0.4 mm/s.
  TimeStepsOptions motion = {
      .step_s = 8e-3, .longest_step_s = 64e-3, .drag_per_s = 40, .quiet_m = 1e-8, .longest_s = 10};
  DescentOptions descent;
  /// Distance that layers keep if the cloth would otherwise pass through itself; 0: no repulsion.
  double thickness_m = 0.5e-3;
};

/// Spacings of the meshes from coarse to fine: halved from the coarsest down to the finest,
/// `options.spacing_m`. A single one if the finest is not below the coarsest.
[[nodiscard]] std::vector<double> level_spacings_m(const DrapeOptions& options);

/// A cloth with its surroundings, in the frame of its sheet (start/start.hpp).
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

/// State of contact: friction springs by material point, with which another mesh of the same cloth
/// can continue (drape/pushes.hpp).
struct ContactMemory;

/// Complete state of a cloth on one mesh, from which a drape can continue.
struct ClothMoment {
  MeshCloth::State state;                        ///< points, then edges (mesh/mesh_cloth.hpp)
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

/// The cloth of a case on one mesh, with its holds and contacts. Not thread-safe; levels of one
/// case share no mutable state.
class DrapeLevel {
 public:
  /// Meshes the outline, with points at pins and mesh edges along clamps. `drape` must outlive it.
  DrapeLevel(const DrapeCase& drape, const DrapeOptions& options, double spacing_m);
  ~DrapeLevel();
  DrapeLevel(const DrapeLevel&) = delete;
  DrapeLevel& operator=(const DrapeLevel&) = delete;

  [[nodiscard]] const DrapeCase& drape() const;
  [[nodiscard]] const MeshCloth& cloth() const;
  [[nodiscard]] double spacing_m() const;
  [[nodiscard]] const std::vector<bool>& held() const;   ///< per unknown
  [[nodiscard]] const std::vector<int>& pinned() const;  ///< mesh points in the order of scene.pins
  [[nodiscard]] const std::vector<Eigen::Vector3d>& pinned_at() const;  ///< their positions
  [[nodiscard]] double mass_kg() const;

  /// The scene's start: flat, with pins and clamps still to be moved to their targets by fall(), or
  /// the measured shape with pins and clamps at their targets.
  [[nodiscard]] ClothMoment start(const StartVariation& variation = {}) const;
  /// Start with another shape, given by positions (local frame) of material points that are not
  /// all collinear, extrapolated elsewhere (drape/smooth_surface.hpp). Pins and clamps are in
  /// place.
  [[nodiscard]] ClothMoment start_at(const std::vector<Eigen::Vector2d>& material_m,
                                     const std::vector<Eigen::Vector3d>& places) const;
  /// Transfers an equilibrium of the same cloth from another mesh, with its friction state.
  [[nodiscard]] ClothMoment carried(const DrapeLevel& from, const ClothMoment& rest) const;

  /// Sets gravity (m/s^2, local frame) or friction for all later calls, for pushes and variations;
  /// initially those of the scene.
  void set_gravity(const Eigen::Vector3d& gravity_m_per_s2);
  void set_friction(double coefficient);

  /// Lets the cloth fall in time until it is quiet, then relaxes it to equilibrium. Meanwhile pins
  /// and clamps move to their targets.
  RestReport fall(ClothMoment& moment, const StartVariation& variation = {});
  /// Relaxes the cloth to equilibrium from its state and updates friction at the end of each
  /// descent. Stops at `residual`, in mean weights of a point; absent: that of the options.
  RestReport rest(ClothMoment& moment, std::optional<double> residual = std::nullopt);

  /// Internal plus gravity plus contact energy (J); gravity relative to the local origin.
  [[nodiscard]] double energy_j(const ClothMoment& moment) const;
  /// Nodes of the surface: the points, then the midpoint of each edge (mesh/mesh_cloth.hpp).
  [[nodiscard]] MeshCloth::State surface(const ClothMoment& moment) const;
  /// Positions (local frame) of material points, one row each; NaN outside the cloth.
  [[nodiscard]] Eigen::MatrixX3d places(const ClothMoment& moment,
                                        const std::vector<Eigen::Vector2d>& material_m) const;
  /// Contact forces of objects, then of layers, on nodes of the surface.
  [[nodiscard]] std::vector<ContactForce> contact_forces(const ClothMoment& moment) const;
  [[nodiscard]] CertificateStrains strains(const ClothMoment& moment) const;
  [[nodiscard]] bool meets_itself(const ClothMoment& moment) const;

  /// Net force on the unknowns (N; N m for edges): internal, gravity and contact. Uses the case's
  /// surroundings at the time of the call.
  [[nodiscard]] MeshCloth::State forces(const ClothMoment& moment) const;

  /// First-order displacement of all unknowns, in their units, due to each of some small changes of
  /// the forces (N; N m for edges). Solves H dx = df by preconditioned conjugate gradients on exact
  /// products with the Hessian. Contacts keep their state: pressed points stay pressed, sticking
  /// points stick, sliding points slide. nullopt if H is not positive definite. `residual`: norm of
  /// the residual relative to that of the change, in the metric of the preconditioner, where it is
  /// the relative error in energy.
  [[nodiscard]] std::optional<std::vector<MeshCloth::State>> first_order(
      const ClothMoment& rest, const std::vector<MeshCloth::State>& force_changes,
      double residual = 1e-6);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Result of a drape on one mesh.
struct LevelReport {
  double spacing_m = 0;
  int points = 0;
  RestReport rest;
  /// Mean move of the print's marks from the next coarser mesh; absent on the coarsest.
  std::optional<double> moved_m;
};

/// A drape from its start to rest on the finest mesh.
struct Drape {
  std::shared_ptr<DrapeLevel> level;  ///< the finest level
  ClothMoment rest;
  std::vector<LevelReport> levels;  ///< ordered from coarse to fine, up to the last one reached
  /// Positions of the print's marks on each level (local frame), one row per mark in the order of
  /// `marks`. If the last refinement jumped to another branch, those before it are of the finest
  /// branch, reached from the finest mesh.
  std::vector<Eigen::MatrixX3d> marks_of_level;
  std::vector<MarkId> marks;
  /// Estimated distance (m) of each mark from the limit of infinite refinement; empty for one
  /// level. See mesh_error_m().
  Eigen::VectorXd mesh_error_m;
  std::vector<std::string> warnings;

  [[nodiscard]] bool at_rest() const { return levels.back().rest.at_rest; }
};

/// Mean distance (m) of corresponding rows; nullopt if there are none without NaN.
[[nodiscard]] std::optional<double> mean_apart_m(const Eigen::MatrixX3d& a,
                                                 const Eigen::MatrixX3d& b);

/// Estimated distance (m) of each mark from the limit of infinite refinement, for two levels or
/// more: F d / (r - 1) (grid convergence index: Roache 1994). d is the move of the mark between the
/// last two levels, at least half of its mean over the marks, since a mark may cross its limit. r
/// is the ratio by which the mean of d decreased from the level before, limited to 2 .. 4. With
/// pins it is 2 whatever was seen: the stretch near a pin grows with the logarithm of the spacing,
/// by the same length per level, masked at first by other errors. Two levels show no r: it is 4.
/// The safety factor F is 3, or 1.25 (Oberkampf and Roy 2010, section 8.6.4) if neither pins nor
/// clamps hold the cloth and the order of convergence seen on three levels is within 0.2 of 2, that
/// of contact and bending. `marks_of_level` has a row per mark. If the last refinement jumped to
/// another branch, the last two are of the finest branch, and r is 2: no order is seen on it.
[[nodiscard]] Eigen::VectorXd mesh_error_m(const DrapeCase& drape,
                                           const std::vector<LevelReport>& levels,
                                           const std::vector<Eigen::MatrixX3d>& marks_of_level,
                                           bool jumped = false);

/// Returns the start of a cloth on the coarsest mesh, in place of DrapeLevel::start().
using DrapeStart = std::function<ClothMoment(const DrapeLevel& level)>;

/// Called with the fraction of the work done.
using DrapeProgress = std::function<void(double fraction)>;

/// Drapes a cloth in nested levels. It falls in time on the coarsest mesh; its shape and friction
/// state are then transferred to each finer mesh and relaxed there. See start.hpp for starts from
/// the measured shape and for histories. A cloth that passes through itself is draped again from
/// the same start with repulsion between layers. `start` replaces the scene's start.
[[nodiscard]] Drape drape_cloth(const DrapeCase& drape, const DrapeOptions& options,
                                const StartVariation& variation = {},
                                const DrapeProgress& progress = {}, const DrapeStart& start = {});

/// Continues from an equilibrium on a coarser mesh, as drape_cloth() does from its coarsest.
[[nodiscard]] Drape polished(const DrapeCase& drape, const DrapeOptions& options,
                             std::shared_ptr<DrapeLevel> coarse, const ClothMoment& rest);

}  // namespace drape::simulate
