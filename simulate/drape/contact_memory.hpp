// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace drape::simulate {

/// What contact remembers of a cloth, by material place, so that another mesh of the same cloth can
/// go on from it.
struct ContactMemory {
  /// A place that an object presses.
  struct Place {
    int shape = 0;
    Eigen::Vector2d material_m;                           ///< (warp, weft)
    double pressed_n_per_m2 = 0;                          ///< carried on by the multiplier; 0: none
    Eigen::Vector3d stretch_m = Eigen::Vector3d::Zero();  ///< stretch of its spring of friction
  };
  std::vector<Place> objects;
  double firmness = 1;  ///< factor of the springs' first stiffness
};

}  // namespace drape::simulate
