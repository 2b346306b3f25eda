// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "core/marks.hpp"
#include "triangulate/point.hpp"

namespace drape {

using PointsByMark = std::map<MarkId, Eigen::Vector3d>;  ///< metres, world frame

/// The measured cloth around a mark: tangents, and curvature as in DotInCamera (world frame).
struct SurfacePatch {
  Eigen::Vector3d axis_u, axis_v;  ///< unit, at right angles, u along the warp
  Eigen::Matrix2d curvature_per_m;
};

/// Quadratic through the mark that fits its measured neighbours; nothing when they do not span
/// both directions.
[[nodiscard]] std::optional<SurfacePatch> surface_patch(const PointsByMark& points, MarkId mark);

/// Views whose pixels are moved from the centroid of the dot's image to the image of its centre,
/// for a round dot on this patch. Eccentricity is a matter of perspective (Heikkila 2000); a dot
/// on a bent surface looks as if it lay under it.
[[nodiscard]] std::vector<View> without_dot_shape(const std::vector<View>& views,
                                                  const Eigen::Vector3d& in_world,
                                                  const SurfacePatch& patch, double dot_diameter_m);

}  // namespace drape
