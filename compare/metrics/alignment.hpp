// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "compare/metrics/metrics.hpp"

namespace drape::compare {

/// Rest of the distances after the real marks were moved onto the virtual ones as one rigid
/// body. Reported beside the distances, never instead of them: where a cloth lies is part of what
/// is judged.
struct RigidAlignment {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< virtual_from_real, about the world
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< origin; p_virtual = rotation p + shift
  double turn_rad = 0;                                ///< angle of the rotation
  double centroid_shift_m = 0;                        ///< way of the real centroid
  DistanceStatistics after;
};

/// Least squares without scale (Kabsch 1976; Umeyama 1991). Nothing below three marks or when the
/// marks lie on one line, where the turn is not determined.
[[nodiscard]] std::optional<RigidAlignment> align(const std::vector<MarkError>& marks);

}  // namespace drape::compare
