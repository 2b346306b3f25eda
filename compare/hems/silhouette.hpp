// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace drape::compare {

using Outline = std::vector<Eigen::Vector2d>;

/// The largest thing in a picture that stands out from what lies along the picture's border, dark
/// on light or light on dark.
struct Silhouette {
  int width_px = 0, height_px = 0;
  double background = 0, object = 0;  ///< median grey levels, 0 .. 1
  /// Outline where the grey is a quarter, half and three quarters from background to object, by
  /// linear interpolation between pixels; counter-clockwise with y up: (u, -v) in px.
  Outline quarter, half, three_quarters;
  /// The largest hole at half, such as a clamping disc of another grey: (u, -v) in px.
  Outline hole;
  std::vector<std::string> warnings;
};

/// PNG, JPEG, TIFF ..., 8 or 16 bit. Throws Error(bad_input) naming the file when it is no picture,
/// shows no silhouette, or the silhouette touches the border.
[[nodiscard]] Silhouette read_silhouette(const std::filesystem::path& file);

/// An ellipse of the outline's second moments of area: exact for an ellipse.
struct EllipseFit {
  Eigen::Vector2d centre;
  Eigen::Vector2d semi_axes;  ///< larger first
  Eigen::Matrix2d axes;       ///< columns: unit directions
  double misfit = 0;          ///< RMS distance of the outline, in parts of the mean semi-axis
};
[[nodiscard]] EllipseFit ellipse_of(const Outline& outline);

/// From picture to metres.
struct PictureScale {
  std::function<Eigen::Vector2d(const Eigen::Vector2d&)> metres_of;  ///< from (u, -v) in px
  std::optional<double> relative_u;  ///< standard uncertainty of lengths
  std::string basis;                 ///< one phrase for the report
  /// Along the slope that a tilted camera sees, of length sin(tilt): what an affine map takes out
  /// of it leaves perspective, points farther off being seen smaller.
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
};

[[nodiscard]] PictureScale scale_of_pixel(double m_per_px, std::optional<double> relative_u);

/// Two points of a ruler in px and its length; each point is known to half a pixel.
[[nodiscard]] PictureScale scale_of_ruler(const Eigen::Vector2d& from_px,
                                          const Eigen::Vector2d& to_px, double length_m);

/// A disc of known diameter: its ellipse is made round, which takes out a tilt but for perspective.
/// The three outlines are those of a silhouette (for a hole: the hole three times). Throws
/// Error(bad_input) when it is no disc (misfit above 2 %) or tilted by more than 20 degrees.
[[nodiscard]] PictureScale scale_of_disc(const Outline& quarter, const Outline& half,
                                         const Outline& three_quarters, double diameter_m,
                                         const std::string& file);

}  // namespace drape::compare
