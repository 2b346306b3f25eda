// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "triangulate/point.hpp"

namespace drape::triangulate {

/// Normal of the cloth at a dot, in the world frame, on the side its cameras see.
struct DotNormal {
  Eigen::Vector3d normal;
  double sigma_rad = 0;  ///< standard deviation of its less certain direction
  double misfit = 0;     ///< RMS of the ellipses' shape, as a fraction of the dot's own size
};

/// Normal from the ellipses alone: a round dot's outline tells its tilt in each view, and two
/// views tell apart the two tilts that one view leaves open (shape from texture, paper's dots).
/// Nothing with fewer than two views, or where the ellipses fit no round dot.
[[nodiscard]] std::optional<DotNormal> normal_from_ellipses(const std::vector<View>& views,
                                                            const Eigen::Vector3d& in_world,
                                                            double dot_diameter_m);

}  // namespace drape::triangulate
