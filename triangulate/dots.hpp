// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "core/marks.hpp"
#include "triangulate/point.hpp"

namespace drape::triangulate {

/// Normal of the cloth at a dot, in the world frame, on the side that the cameras see.
struct DotNormal {
  Eigen::Vector3d normal;
  double sigma_rad = 0;  ///< standard deviation in the less certain direction
  double misfit = 0;     ///< RMS misfit of the ellipses' shapes, as a fraction of the dot's size
};

/// Normal from the ellipses alone: the outline of a round dot gives its tilt in each view up to a
/// twofold ambiguity that a second view resolves (shape from texture, for the paper's dots).
/// nullopt for fewer than two views, or if the ellipses fit no round dot.
[[nodiscard]] std::optional<DotNormal> normal_from_ellipses(const std::vector<View>& views,
                                                            const Eigen::Vector3d& in_world,
                                                            double dot_diameter_m);

/// A measured mark with the normal derived from its ellipses.
struct MarkOnSurface {
  Eigen::Vector3d in_world;  ///< metres
  std::optional<DotNormal> normal;
};

using MarksOnSurface = std::map<MarkId, MarkOnSurface>;

/// Standard deviation of the curvature predicted by a mark's neighbours: `least_per_m` (bumps and
/// creases between marks) combined with `fraction` times the strongest curvature seen between the
/// dot and its neighbours. With a fraction of 1, the true curvature at the mark may range from zero
/// to twice the observed one.
struct CurvatureTrust {
  double least_per_m = 10;
  double fraction = 1;
};

/// Estimates least_per_m from the cloth itself. Along each line of marks, the curvature predicted
/// from every second neighbour is compared with that from the nearest ones. The change over the
/// flatter half of the lines (RMS) is assumed to recur when the distance is halved again. Uses
/// measured marks only; with fewer than 20 such lines the default is kept.
[[nodiscard]] CurvatureTrust curvature_trust(const MarksOnSurface& marks, double pitch_m);

/// Local surface of the measured cloth around a mark, in the world frame.
struct SurfacePatch {
  Eigen::Vector3d axis_u, axis_v;   ///< orthogonal unit tangents; u x v is the normal
  Eigen::Matrix2d curvature_per_m;  ///< along (u, v), as in DotInCamera
  Eigen::Vector3d noise_per_m;  ///< standard deviations of the curvatures (uu, uv, vv) due to the
                                ///< noise of the normals
  Eigen::Vector3d strongest_per_m;  ///< towards the neighbours used (uu, uv, vv)
  double normal_sigma_rad = 0;

  /// Variances of the curvatures (uu, uv, vv), 1/m^2.
  [[nodiscard]] Eigen::Vector3d curvature_variance(const CurvatureTrust& trust) const;
};

/// Tangent plane from the mark's ellipses; curvature from the positions and normals of its
/// neighbours relative to that plane along warp and weft. Without a normal the patch faces the
/// cameras; without neighbours the curvature is zero, with the uncertainty of an unknown fold.
[[nodiscard]] SurfacePatch surface_patch(const MarksOnSurface& marks, MarkId mark, double pitch_m,
                                         const Eigen::Vector3d& to_cameras);

/// Corrects the views' pixels for the shape of the dot. The uncertain parameters of the patch,
/// three curvatures and two tilts, become unknowns shared by the views: views from different
/// directions constrain the dot's curvature.
[[nodiscard]] std::vector<View> without_dot_shape(const std::vector<View>& views,
                                                  const Eigen::Vector3d& in_world,
                                                  const SurfacePatch& patch,
                                                  const CurvatureTrust& trust,
                                                  double dot_diameter_m);

}  // namespace drape::triangulate
