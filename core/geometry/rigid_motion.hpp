// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/pose.hpp"

namespace drape {

/// The rotation nearest to a matrix in the Frobenius norm.
[[nodiscard]] Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix);

/// Rotation and translation, without scale, that best map the points `from` to the points `to`,
/// column by column, in the least-squares sense (Kabsch 1976; Umeyama 1991). nullopt for fewer than
/// three points or collinear ones.
[[nodiscard]] std::optional<Pose<void, void>> rigid_motion(const Eigen::Matrix3Xd& from,
                                                           const Eigen::Matrix3Xd& to);

/// The same motion, as the pose of one named frame in another.
template <class To, class From>
[[nodiscard]] std::optional<Pose<To, From>> pose_from_points(const Eigen::Matrix3Xd& from,
                                                             const Eigen::Matrix3Xd& to) {
  const auto motion = rigid_motion(from, to);
  if (!motion) return std::nullopt;
  return Pose<To, From>{motion->rotation, motion->translation_m};
}

}  // namespace drape
