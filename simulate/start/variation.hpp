// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace drape::simulate {

/// Deviation of a start from that of the scene in what an operator cannot control; by default
/// none.
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

}  // namespace drape::simulate
