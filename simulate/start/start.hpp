// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/dynamics/motion.hpp"

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

/// Start positions and holds.
struct StartState {
  Field position;
  std::vector<Hold> holds;
  std::vector<Eigen::Vector3d> hold_in_world;  ///< where each held point must be
  StartReport report;
};

/// Material coordinates of a particle.
[[nodiscard]] Eigen::Vector2d material_of(const GridSpec& grid, int row, int col);

/// The held point as a bilinear mixture of the particles around it.
[[nodiscard]] Hold hold_at(const GridSpec& grid, const Eigen::Vector2d& material_m);

/// Rigid fit of material coordinates to the horizontal position of the measured marks that lie
/// near the highest of them; weights fall off with depth below it and with distance from the fit.
[[nodiscard]] FlatPose fit_flat(const Sheet& measured, double top_z_m, StartReport& report);

/// Smooth surface through the measured marks, continued without bending beyond them: the least
/// squares solution of the marks' positions and of vanishing second differences.
[[nodiscard]] Field fill_measured(const Sheet& measured, const GridSpec& grid);

/// Throws Error(bad_input) for a patch with a side outside 0.1 mm to 100 m.
void require_sized(const GridSpec& grid, const Scene& scene);

/// Start state for a scene. `measured` is needed by the modes flat_from_measured and measured and
/// by pins without a point of their own. Throws Error(bad_input) for these, and as
/// require_sized().
[[nodiscard]] StartState make_start(const Scene& scene, const Print& print, const GridSpec& grid,
                                    const std::optional<Sheet>& measured, double top_z_m,
                                    double imperfection_m);

}  // namespace drape::simulate
