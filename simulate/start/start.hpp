// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
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
  std::vector<std::string> warnings;
};

/// Rigid fit of material coordinates to the horizontal positions of the measured marks near the
/// highest one; weights decrease with depth below it and with the residual.
[[nodiscard]] FlatPose fit_flat(const Sheet& measured, double top_z_m, StartReport& report);

/// Returns the measured sheet; throws an Error that explains why it is needed if there is none.
[[nodiscard]] const Sheet& need_measured(const std::optional<Sheet>& measured, const Scene& scene);

/// Pose of a sheet that starts flat; `report` says which marks determined it. Throws
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

}  // namespace drape::simulate
