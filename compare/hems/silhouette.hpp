// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/metrics/drapemeter.hpp"
#include "compare/metrics/metrics.hpp"

namespace drape::compare {

using Outline = std::vector<Eigen::Vector2d>;

/// The largest object in a picture that differs from the picture's border, dark on light or light
/// on dark.
struct Silhouette {
  int width_px = 0, height_px = 0;
  double background = 0, object = 0;  ///< median grey levels, from 0 to 1
  /// Outlines at a quarter, half and three quarters of the way from background to object grey,
  /// interpolated linearly between pixels; counter-clockwise with y up: (u, -v) in px.
  Outline quarter, half, three_quarters;
  /// The largest hole at half level, such as a clamping disc of another grey: (u, -v) in px.
  Outline hole;
  std::vector<std::string> warnings;
};

/// Reads PNG, JPEG, TIFF ... with 8 or 16 bits. Throws Error(bad_input) naming the file if it is
/// not a picture, shows no silhouette, or the silhouette touches the border.
[[nodiscard]] Silhouette read_silhouette(const std::filesystem::path& file);

/// Conversion from pixels to metres.
struct PictureScale {
  std::function<Eigen::Vector2d(const Eigen::Vector2d&)> metres_of;  ///< position of (u, -v) px
  std::optional<double> relative_u;  ///< relative standard uncertainty of lengths
  std::string basis;                 ///< one phrase for the report
  /// Direction of a camera's tilt, with length sin(tilt): the affine map removes foreshortening but
  /// not perspective, which makes more distant points smaller.
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
};

[[nodiscard]] PictureScale scale_of_pixel(double m_per_px, std::optional<double> relative_u);

/// Scale from two points of a ruler in px and its length; each point is known to half a pixel.
[[nodiscard]] PictureScale scale_of_ruler(const Eigen::Vector2d& from_px,
                                          const Eigen::Vector2d& to_px, double length_m);

/// Scale from a disc of known diameter: makes its ellipse round, which corrects a tilt but not
/// perspective. The outlines are those of a silhouette (for a hole: thrice the same). Throws
/// Error(bad_input) if it is no disc (misfit above 2 %) or tilted by more than 20 degrees.
[[nodiscard]] PictureScale scale_of_disc(const Outline& quarter, const Outline& half,
                                         const Outline& three_quarters, double diameter_m,
                                         const std::string& file);

/// A cloth as triangles in space.
struct ShadowMesh : TriangleMesh {
  std::vector<Eigen::Vector2d> material_m;  ///< empty if unknown
  std::optional<double> flat_area_m2;       ///< flat area of the specimen, if stated
};

/// Shadow on the table under light from straight above: area of the union of all triangles
/// (midpoint rule, 4096 lines), radii about its centroid. Includes the specimen's flat area if
/// material coordinates are known. Throws Error(bad_input) if it does not surround its centre.
[[nodiscard]] Hem shadow_of(const ShadowMesh& mesh);

}  // namespace drape::compare
