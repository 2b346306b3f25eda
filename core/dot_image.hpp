// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/camera_model.hpp"

namespace drape {

/// A printed round dot as it lies in space, in the camera frame (metres).
struct DotInCamera {
  Eigen::Vector3d centre;
  Eigen::Vector3d axis_u, axis_v;  ///< unit tangents of the surface, at right angles
  double radius_m = 0;
  /// Curvature along (u, v) in 1/m: the surface is centre + a u + b v - 1/2 (a,b) S (a,b)' n with
  /// n = u x v. Zero for a plane.
  Eigen::Matrix2d curvature_per_m = Eigen::Matrix2d::Zero();
};

/// Centroid (px) of the area that a dot covers in the image, which is what a fitted ellipse finds.
/// It is not the image of the dot's centre: perspective moves it (eccentricity; Heikkila 2000) and
/// so does curvature (seen from any side a point under a convex surface). Nothing where a part of
/// the outline does not project, or the dot is seen edge-on.
[[nodiscard]] std::optional<Eigen::Vector2d> dot_centroid_px(const CameraModel& model,
                                                             const DotInCamera& dot);

/// By how much that centroid lies beside the image of the dot's centre (px). Nothing where there is
/// none.
[[nodiscard]] std::optional<Eigen::Vector2d> eccentricity_px(const CameraModel& model,
                                                             const DotInCamera& dot);

}  // namespace drape
