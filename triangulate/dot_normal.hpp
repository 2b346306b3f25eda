// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "triangulate/point.hpp"

namespace drape::triangulate {

/// Normal of the cloth at a dot, in the world frame, on the side that the cameras see.
struct DotNormal {
  Eigen::Vector3d normal;
  double sigma_rad = 0;  ///< standard deviation in the less certain direction
  double misfit = 0;     ///< RMS misfit of the ellipses' shapes, as a fraction of the dot's size
};

/// Normal from the ellipses alone: the outline of a round dot gives its tilt in each view up to a
/// twofold ambiguity, which a second view resolves (shape from texture, for the paper's dots).
/// nullopt for fewer than two views, or if the ellipses fit no round dot.
[[nodiscard]] std::optional<DotNormal> normal_from_ellipses(const std::vector<View>& views,
                                                            const Eigen::Vector3d& in_world,
                                                            double dot_diameter_m);

}  // namespace drape::triangulate
