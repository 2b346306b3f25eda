// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/mesh/material_mesh.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// A flat horizontal sheet: centre and direction of the weft, printed side up. Seen from above the
/// warp points 90 degrees clockwise from the weft (core/rig.hpp, Print).
struct FlatPose {
  Eigen::Vector3d centre_in_world = Eigen::Vector3d::Zero();
  double yaw_rad = 0;

  [[nodiscard]] Eigen::Vector3d point_in_world(const Eigen::Vector2d& material_m,
                                               const Eigen::Vector2d& patch_m) const;
};

struct StartReport {
  FlatPose flat;
  int marks_used = 0;           ///< number of measured marks that determined the placement
  double placement_rms_mm = 0;  ///< horizontal RMS distance of these marks from the flat sheet
};

/// Rigid fit of material coordinates to the horizontal positions of the measured marks near the
/// highest one; weights decrease with depth below it and with the residual.
[[nodiscard]] FlatPose fit_flat(const Sheet& measured, double top_z_m, StartReport& report);

/// Returns the measured sheet; throws an Error that explains why it is needed if there is none.
[[nodiscard]] const Sheet& need_measured(const std::optional<Sheet>& measured, const Scene& scene);

/// Pose of a sheet that starts flat; `report` lists the marks that determined it. Throws
/// Error(bad_input) if their misfit exceeds the descent of the marks plus the cloth's possible
/// extension.
[[nodiscard]] FlatPose flat_start(const Scene& scene, const std::optional<Sheet>& measured,
                                  double top_z_m, StartReport& report);

/// Throws Error(bad_input) for a patch with a side outside 0.1 mm to 100 m.
void require_sized(const Print& print, const Scene& scene);

/// Positions at which the scene's pins hold the cloth, in the frame of scene and sheet. Throws
/// Error(bad_input) for a mark that is not on the print, and for a pin without a position of its
/// own if the sheet has none.
[[nodiscard]] std::vector<Eigen::Vector3d> pin_places(const Scene& scene, const Print& print,
                                                      const std::optional<Sheet>& measured);

/// Moves points out of objects and table, along the normal of the nearest surface; returns the
/// largest move (m).
double push_out(std::vector<Eigen::Vector3d>& places, const Surroundings& surroundings);

/// Shape of a cloth, given by the positions of material points (warp, weft).
struct MaterialShape {
  std::vector<Eigen::Vector2d> material_m;
  std::vector<Eigen::Vector3d> places;
  double filled = 0;        ///< fraction of the marks that were not measured
  double pushed_out_m = 0;  ///< largest move of a point out of an object
  std::vector<std::string> warnings;
};

/// Measured shape over the whole patch, in the frame of scene and sheet, on nodes about 5 mm apart
/// that include every mark. Least squares: measured marks keep their positions (weight 100), and
/// second differences along warp, weft and both are minimised, so that missing marks and the margin
/// continue their neighbours with least bending. Nodes inside objects are moved out. Throws
/// Error(bad_input) without a sheet or if its marks do not span a surface.
[[nodiscard]] MaterialShape measured_shape(const Scene& scene, const std::optional<Sheet>& measured,
                                           const Print& print, const Surroundings& surroundings);

/// A scene in the frame of its sheet: origin at the centre of the start, x along the weft, z up.
/// Coordinates are small, and a world that is shifted or rotated about the vertical gives identical
/// numbers: positions of objects and pins are rounded to 0.12 nm, far above the rounding of world
/// coordinates and far below any measurement.
struct LocalScene {
  Scene scene;
  std::optional<Sheet> measured;
  Eigen::Vector3d origin_in_world = Eigen::Vector3d::Zero();
  double yaw_rad = 0;  ///< angle of the local x axis in the world
  StartReport placed;  ///< placement of the flat start

  [[nodiscard]] Eigen::Vector3d to_world(const Eigen::Vector3d& local) const;
  [[nodiscard]] Eigen::MatrixX3d rows_to_world(Eigen::MatrixX3d local) const;  ///< a point per row
  /// Converts a point, with the rounding used for objects.
  [[nodiscard]] Eigen::Vector3d to_local(const Eigen::Vector3d& world) const;
  /// Gravity energy of `mass_kg` in the world frame minus that in this frame (J).
  [[nodiscard]] double gravity_offset_j(double mass_kg) const;
};

/// Transforms a scene; `top_z_m` is the highest point of the objects. Throws like flat_start().
[[nodiscard]] LocalScene local_scene(const Scene& world, const std::optional<Sheet>& measured,
                                     double top_z_m);

/// Variation of a start beyond an operator's control; none by
/// default.
struct StartVariation {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< added to the position of the start
  double friction_factor = 1;                         ///< factor of the scene's coefficient
  double drag_factor = 1;                             ///< factor on the drag during the fall

  double noise_m = 0;   ///< amplitude of random waves
  double tilt_rad = 0;  ///< rotation about a horizontal axis
  double tilt_axis_rad = 0;
  double yaw_rad = 0;
  double lift_m = 0;  ///< additional drop height
  int folds = 0;      ///< number of waves around the sheet
  double fold_m = 0;  ///< their amplitude at the distance of the corners
  double fold_phase_rad = 0;
};

/// Start `index` of a seeded sequence, the same in every run; 0 is the scene's own start.
/// `friction_known`: the coefficient was measured and varies by a tenth, otherwise from half to
/// double. The position varies by 2 mm, the accuracy of laying by hand; the drag from a quarter to
/// fourfold.
[[nodiscard]] StartVariation variation_of(int index, bool friction_known = true);

/// Applies a variation to the points of a start (m), relative to their centre and extent. No point
/// is lowered, so a flat start above all objects stays above them.
void vary(const StartVariation& variation, std::vector<Eigen::Vector3d>& places);

/// A line of the cloth along warp or weft, held by a clamp: its points on a straight line in space,
/// and the direction in which the cloth leaves.
struct HeldLine {
  Eigen::Vector2d from_m, to_m;  ///< material coordinates
  Eigen::Vector3d from, to;      ///< positions of the ends
  /// Derivatives of the position along warp and weft. The one along the line follows from the ends.
  /// The one across it is held at mesh edges on the line and taken as a unit vector, since the
  /// cloth's strain there (about 1e-4) does not affect bending.
  Eigen::Vector3d x_u, x_v;

  [[nodiscard]] Eigen::Vector3d place(const Eigen::Vector2d& material_m) const;
  /// True if a material point lies on the line.
  [[nodiscard]] bool holds(const Eigen::Vector2d& material_m) const;
};

/// Clamps of a scene, in its frame and order. Cloth leaves a clamp in the stated direction towards
/// larger coordinates; towards smaller ones only at a far hem. Throws Error(bad_input) for a clamp
/// that is off the cloth, has no length, crosses the threads or points along itself, and for two
/// clamps, or a clamp and a pin, that hold one material point at two positions.
[[nodiscard]] std::vector<HeldLine> held_lines(const Scene& scene, const Print& print,
                                               const ClothOutline& outline);

/// Warnings, one for each pair of clamps that meet at a kink of the cloth.
[[nodiscard]] std::vector<std::string> warnings_of_clamps(const std::vector<HeldLine>& lines);

/// Throws Error(bad_input) naming two pins farther apart in space than the cloth between them can
/// reach along its threads, each stretched to the end of its measured curve.
void check_pins(const Scene& scene, const Print& print, const Fabric& fabric);

/// Throws Error(bad_input) naming `start.centre_mm` and the required increase of height if a point
/// of the scene's own flat start is inside an object or below the table by more than a cloth's
/// thickness. A solver cannot know on which side it should emerge, and cloth that emerges below
/// falls past the object. Other starts lie outside objects.
void refuse_flat_start_inside(const Scene& scene, const Print& print, const ClothOutline& outline,
                              const Surroundings& surroundings);

/// Throws Error(bad_input) naming a pin that is off the cloth.
void refuse_pins_beside(const Scene& scene, const Print& print, const ClothOutline& outline);

/// Throws Error(bad_input) unless gravity is that of the Earth.
void require_gravity_of_earth(const Scene& scene);

/// Warnings about a scene's drape: gravity that is not Earth's, and cloth that touches no object:
/// `least_gap_m`, its smallest distance (absent without objects), exceeds the mesh spacing.
[[nodiscard]] std::vector<std::string> warnings_of_scene(const Scene& scene,
                                                         std::optional<double> least_gap_m,
                                                         double spacing_m);

}  // namespace drape::simulate
