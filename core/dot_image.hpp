// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/camera_model.hpp"

namespace drape {

/// Position and surface of a printed round dot in the camera frame (metres).
struct DotInCamera {
  Eigen::Vector3d centre;
  Eigen::Vector3d axis_u, axis_v;  ///< orthogonal unit tangents of the surface
  double radius_m = 0;
  /// Curvature along (u, v) in 1/m: the surface is centre + a u + b v - 1/2 (a,b) S (a,b)' n with
  /// n = u x v. Zero for a plane.
  Eigen::Matrix2d curvature_per_m = Eigen::Matrix2d::Zero();
};

/// Centroid (px) of the image area that a dot covers: the centre of the fitted ellipse. It
/// differs from the image of the dot's centre, shifted by perspective (eccentricity; Heikkila
/// 2000) and by curvature. nullopt if part of the outline does not project or the dot is seen
/// edge-on.
[[nodiscard]] std::optional<Eigen::Vector2d> dot_centroid_px(const CameraModel& model,
                                                             const DotInCamera& dot);

/// Offset (px) of that centroid from the image of the dot's centre. nullopt if there is no
/// centroid.
[[nodiscard]] std::optional<Eigen::Vector2d> eccentricity_px(const CameraModel& model,
                                                             const DotInCamera& dot);

}  // namespace drape
