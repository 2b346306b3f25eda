// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>

#include "core/marks.hpp"
#include "triangulate/dot_normal.hpp"

namespace drape::triangulate {

/// A measured mark with the normal that its ellipses tell.
struct MarkOnSurface {
  Eigen::Vector3d in_world;  ///< metres
  std::optional<DotNormal> normal;
};
using MarksOnSurface = std::map<MarkId, MarkOnSurface>;

/// Standard deviation of the curvature that a mark's neighbours tell: it is made of `least_per_m`
/// (bumps and creases that no neighbour shows) and of `fraction` times the strongest bend seen
/// between the dot and its neighbours. A fraction of 1 says that the bend they show may lie wholly
/// between them or be twice as sharp at the mark.
struct CurvatureTrust {
  double least_per_m = 10;
  double fraction = 1;
  int lines = 0;  ///< lines that least_per_m was learned from; 0: it is the default
};

/// Learns least_per_m from the cloth itself: along each line of marks the curvature that every
/// second neighbour predicts is compared with the one from the nearest, and what halving the
/// distance changed on the flatter half of the lines (RMS) it is taken to change again. Only
/// measured marks enter; with fewer than 20 such lines the default stays.
[[nodiscard]] CurvatureTrust curvature_trust(const MarksOnSurface& marks, double pitch_m);

/// The measured cloth around a mark, in the world frame.
struct SurfacePatch {
  Eigen::Vector3d axis_u, axis_v;   ///< unit tangents at right angles; u x v is the normal
  Eigen::Matrix2d curvature_per_m;  ///< along (u, v), as in DotInCamera
  Eigen::Vector3d noise_per_m;  ///< standard deviations of the curvatures (uu, uv, vv), from the
                                ///< normals' own noise
  Eigen::Vector3d strongest_per_m;  ///< bend towards the neighbours that show it (uu, uv, vv)
  double normal_sigma_rad = 0;

  /// Variances of the curvatures (uu, uv, vv), 1/m^2.
  [[nodiscard]] Eigen::Vector3d curvature_variance(const CurvatureTrust& trust) const;
};

/// Tangent plane from the mark's ellipses, curvature from how its neighbours' places and normals
/// leave that plane along warp and weft. Where there is no normal the patch faces the cameras;
/// where no neighbour tells the curvature it is zero, with the noise of an unknown fold.
[[nodiscard]] SurfacePatch surface_patch(const MarksOnSurface& marks, MarkId mark, double pitch_m,
                                         const Eigen::Vector3d& to_cameras);

}  // namespace drape::triangulate
