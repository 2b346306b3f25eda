// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/pose.hpp"

namespace drape {

/// The rotation nearest to a matrix (least sum of squared differences of elements).
[[nodiscard]] Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix);

/// Rotation and translation, without scale, that take the points `from` best to the points `to`,
/// column by column, in the sense of least squares (Kabsch 1976; Umeyama 1991). Nothing below three
/// points or where they lie on one line.
[[nodiscard]] std::optional<Pose<void, void>> rigid_motion(const Eigen::Matrix3Xd& from,
                                                           const Eigen::Matrix3Xd& to);

/// The same as the pose of a named frame in another.
template <class To, class From>
[[nodiscard]] std::optional<Pose<To, From>> pose_from_points(const Eigen::Matrix3Xd& from,
                                                             const Eigen::Matrix3Xd& to) {
  const auto motion = rigid_motion(from, to);
  if (!motion) return std::nullopt;
  return Pose<To, From>{motion->rotation, motion->translation_m};
}

}  // namespace drape
