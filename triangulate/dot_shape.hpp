// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "triangulate/point.hpp"
#include "triangulate/surface_patch.hpp"

namespace drape::triangulate {

/// Shift of a dot's image in one view, caused by the dot's shape.
struct DotShift {
  Eigen::Vector2d px;  ///< image of the centre minus centroid of the image
  Eigen::Matrix<double, 2, 3> px_per_curvature;  ///< derivative by curvature (uu, uv, vv), px m
  Eigen::Matrix2d px_per_tilt;  ///< derivative by rotation about (u, v), px per rad
};

/// Shift for a round dot on this patch: perspective causes eccentricity (Heikkila 2000), and a dot
/// on a curved surface appears to lie beneath it. nullopt if the dot's outline does not project.
[[nodiscard]] std::optional<DotShift> dot_shift(const Camera& camera,
                                                const Eigen::Vector3d& in_world,
                                                const SurfacePatch& patch, double dot_diameter_m);

/// Corrects the views' pixels for the shape of the dot. The uncertain parameters of the patch,
/// three curvatures and two tilts, become unknowns shared by the views: several views from
/// different directions constrain the dot's curvature.
[[nodiscard]] std::vector<View> without_dot_shape(const std::vector<View>& views,
                                                  const Eigen::Vector3d& in_world,
                                                  const SurfacePatch& patch,
                                                  const CurvatureTrust& trust,
                                                  double dot_diameter_m);

}  // namespace drape::triangulate
