// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

namespace drape {

/// Frames of reference. The types exist only to name the two ends of a Pose.
namespace frame {
struct World;   ///< right-handed, z up; origin and axes of the target in its reference pose
struct Camera;  ///< x right, y down, z forward
struct Target;  ///< printed face of the calibration target, z pointing out of it
struct Object;  ///< body frame of an object under the cloth
}  // namespace frame

/// Rigid transform of points from frame From to frame To: p_to = R p_from + t (metres). Composition
/// compiles only if the inner frames agree, so a pose cannot be applied backwards.
template <class To, class From>
struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& point_in_from) const {
    return rotation * point_in_from + translation_m;
  }

  template <class Start>
  [[nodiscard]] Pose<To, Start> operator*(const Pose<From, Start>& from_from_start) const {
    return {rotation * from_from_start.rotation,
            rotation * from_from_start.translation_m + translation_m};
  }

  [[nodiscard]] Pose<From, To> inverse() const {
    return {rotation.transpose(), -(rotation.transpose() * translation_m)};
  }
};

using CamFromWorld = Pose<frame::Camera, frame::World>;
using WorldFromTarget = Pose<frame::World, frame::Target>;
using CamFromTarget = Pose<frame::Camera, frame::Target>;
using WorldFromObject = Pose<frame::World, frame::Object>;

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
