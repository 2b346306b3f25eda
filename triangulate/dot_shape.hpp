// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "core/marks.hpp"
#include "triangulate/dot_normal.hpp"
#include "triangulate/point.hpp"

namespace drape {

/// A measured mark with the normal that its ellipses tell.
struct MarkOnSurface {
  Eigen::Vector3d in_world;  ///< metres
  std::optional<DotNormal> normal;
};
using MarksOnSurface = std::map<MarkId, MarkOnSurface>;

/// The measured cloth around a mark, in the world frame.
struct SurfacePatch {
  Eigen::Vector3d axis_u, axis_v;    ///< unit tangents at right angles; u x v is the normal
  Eigen::Matrix2d curvature_per_m;   ///< along (u, v), as in DotInCamera
  double curvature_sigma_per_m = 0;  ///< how well the neighbours, a pitch away, tell it
};

/// Tangent plane from the mark's ellipses, curvature from how its neighbours' places and normals
/// leave that plane along warp and weft. Where there is no normal the patch faces the cameras;
/// where no neighbour tells the curvature it is zero, with the sigma of an unknown fold.
[[nodiscard]] SurfacePatch surface_patch(const MarksOnSurface& marks, MarkId mark, double pitch_m,
                                         const Eigen::Vector3d& to_cameras);

/// Views whose pixels are moved from the centroid of the dot's image to the image of its centre,
/// for a round dot on this patch. Eccentricity is a matter of perspective (Heikkila 2000); a dot
/// on a bent surface looks as if it lay under it. What the curvature's uncertainty means in each
/// view is added to the views' covariances.
[[nodiscard]] std::vector<View> without_dot_shape(const std::vector<View>& views,
                                                  const Eigen::Vector3d& in_world,
                                                  const SurfacePatch& patch, double dot_diameter_m);

/// Standard deviation (metres, along the normal) that the patch's curvature leaves in the place.
[[nodiscard]] double shape_sigma_m(const SurfacePatch& patch, double dot_diameter_m);

}  // namespace drape
