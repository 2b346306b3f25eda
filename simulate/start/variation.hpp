// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace drape::simulate {

/// Departure of one start from the scene's in what an operator cannot know; as it stands: the
/// scene's own.
struct StartVariation {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< added to the start's place
  double friction_factor = 1;                         ///< factor of the scene's coefficient
  double drag_factor = 1;                             ///< factor of the fall's drag

  double noise_m = 0;   ///< height of random waves
  double tilt_rad = 0;  ///< about a horizontal axis
  double tilt_axis_rad = 0;
  double yaw_rad = 0;
  double lift_m = 0;  ///< added drop height
  int folds = 0;      ///< waves seeded around the sheet
  double fold_m = 0;  ///< their height at the corners' distance
  double fold_phase_rad = 0;
};

/// Start `index` of a seeded sequence; 0 is the scene's own start. The same for every run.
/// `friction_known`: the coefficient was measured and varies by a tenth, else by half to double.
/// The place varies by 2 mm, by which a hand lays a sheet beside it; the drag by a quarter to
/// fourfold.
[[nodiscard]] StartVariation variation_of(int index, bool friction_known = true);

/// Moves the places of a start (m), whose middle and reach are those of all of them. No place is
/// lowered, so that a flat start above all objects stays above them.
void vary(const StartVariation& variation, std::vector<Eigen::Vector3d>& places);

}  // namespace drape::simulate
