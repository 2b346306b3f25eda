// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "triangulate/point.hpp"
#include "triangulate/surface_patch.hpp"

namespace drape::triangulate {

/// Shift of a dot's image in one view by the dot's shape.
struct DotShift {
  Eigen::Vector2d px;  ///< image of its centre minus centroid of its image
  Eigen::Matrix<double, 2, 3> px_per_curvature;  ///< by curvature (uu, uv, vv), px m
  Eigen::Matrix2d px_per_tilt;                   ///< by turns about (u, v), px per rad
};

/// For a round dot on this patch. Eccentricity is a matter of perspective (Heikkila 2000); a dot on
/// a bent surface looks as if it lay under it. Nothing where the dot's outline does not project.
[[nodiscard]] std::optional<DotShift> dot_shift(const Camera& camera,
                                                const Eigen::Vector3d& in_world,
                                                const SurfacePatch& patch, double dot_diameter_m);

/// Views whose pixels are moved by the dot's shape. What is not known of the patch, its three
/// curvatures and two tilts, becomes the views' shared unknowns: a dot that several cameras see
/// under different tilts tells of its own bend.
[[nodiscard]] std::vector<View> without_dot_shape(const std::vector<View>& views,
                                                  const Eigen::Vector3d& in_world,
                                                  const SurfacePatch& patch,
                                                  const CurvatureTrust& trust,
                                                  double dot_diameter_m);

}  // namespace drape::triangulate
