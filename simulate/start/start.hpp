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

/// A flat horizontal sheet: its centre and the direction of the weft, printed side up. Seen from
/// above the warp points 90 degrees clockwise from the weft (core/rig.hpp, Print).
struct FlatPose {
  Eigen::Vector3d centre_in_world = Eigen::Vector3d::Zero();
  double yaw_rad = 0;

  [[nodiscard]] Eigen::Vector3d point_in_world(const Eigen::Vector2d& material_m,
                                               const Eigen::Vector2d& patch_m) const;
};

struct StartReport {
  FlatPose flat;
  int marks_used = 0;           ///< measured marks that placed the sheet
  double placement_rms_mm = 0;  ///< horizontal distance of those marks from the flat sheet
  std::vector<std::string> warnings;
};

/// Rigid fit of material coordinates to the horizontal position of the measured marks that lie
/// near the highest of them; weights fall off with depth below it and with distance from the fit.
[[nodiscard]] FlatPose fit_flat(const Sheet& measured, double top_z_m, StartReport& report);

/// The measured sheet, or an Error that says why it is needed.
[[nodiscard]] const Sheet& need_measured(const std::optional<Sheet>& measured, const Scene& scene);

/// Place of a sheet that starts flat; `report` says which marks placed it. Throws
/// Error(bad_input) where they miss the flat cloth by more than they have come down and it can be
/// extended.
[[nodiscard]] FlatPose flat_start(const Scene& scene, const std::optional<Sheet>& measured,
                                  double top_z_m, StartReport& report);

/// Throws Error(bad_input) for a patch with a side outside 0.1 mm to 100 m.
void require_sized(const Print& print, const Scene& scene);

/// Places where the scene's pins hold the cloth, in the frame of scene and sheet. Throws
/// Error(bad_input) for a mark that the print lacks, and for a pin without a place of its own where
/// the sheet has none.
[[nodiscard]] std::vector<Eigen::Vector3d> pin_places(const Scene& scene, const Print& print,
                                                      const std::optional<Sheet>& measured);

/// Moves places out of objects and table, each along the normal of its nearest surface; farthest
/// move (m).
double push_out(std::vector<Eigen::Vector3d>& places, const Surroundings& surroundings);

/// Shape of a cloth by the places of material points (warp, weft).
struct MaterialShape {
  std::vector<Eigen::Vector2d> material_m;
  std::vector<Eigen::Vector3d> places;
  double filled = 0;        ///< share of the marks that were not measured
  double pushed_out_m = 0;  ///< farthest move of a place out of an object
  std::vector<std::string> warnings;
};

/// The measured shape over the whole patch, in the frame of scene and sheet, on nodes some 5 mm
/// apart of which one is each mark. Least squares: measured marks keep their places (weight 100),
/// and second differences of the nodes along warp, weft and both vanish. So marks that were not
/// measured, and the margin, continue their neighbours with least bending. Nodes inside objects
/// move out. Throws Error(bad_input) without a sheet or where its marks span no surface.
[[nodiscard]] MaterialShape measured_shape(const Scene& scene, const std::optional<Sheet>& measured,
                                           const Print& print, const Surroundings& surroundings);

}  // namespace drape::simulate
