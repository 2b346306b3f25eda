// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "compare/metrics/metrics.hpp"

namespace drape::compare {

/// Remaining distances after moving the real marks onto the virtual ones as a rigid body. Reported
/// in addition to the distances, never instead: the position of the cloth is part of the
/// comparison.
struct RigidAlignment {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< virtual_from_real, about the origin
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< in world; p_virtual = rotation p + shift
  double turn_rad = 0;                                ///< angle of the rotation
  double centroid_shift_m = 0;                        ///< displacement of the real centroid
  DistanceStatistics after;
};

/// Least-squares alignment without scale (Kabsch 1976; Umeyama 1991). nullopt for fewer than three
/// marks or collinear ones, which leave the rotation undetermined.
[[nodiscard]] std::optional<RigidAlignment> align(const std::vector<MarkError>& marks);

}  // namespace drape::compare
