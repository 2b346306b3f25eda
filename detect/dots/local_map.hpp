// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

namespace drape::detect {

/// Where a printed point is seen and how the print maps to the image around it.
struct LocalMap {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d px_per_m;  ///< derivative of the pixel by the position on the print
};

/// The map at the middle of a quadrangle, from the homography of its four corners; nothing for
/// degenerate corners.
[[nodiscard]] std::optional<LocalMap> map_at_centre(const std::array<Eigen::Vector2d, 4>& print_m,
                                                    const Eigen::Matrix<double, 2, 4>& corners_px,
                                                    const Eigen::Vector2d& centre_m);

/// The map at a dot: its ellipse J J^T fixes J up to a rotation within the print, and the rotation
/// is taken that brings J closest to a neighbour's map.
[[nodiscard]] LocalMap map_of_dot(const Eigen::Vector2d& centre_px,
                                  const Eigen::Matrix2d& shape_px2, double dot_radius_m,
                                  const Eigen::Matrix2d& neighbour_px_per_m);

/// The same from the symmetric root of the ellipse's shape divided by the dot's radius (px per m),
/// for callers that ask for many neighbours.
[[nodiscard]] Eigen::Matrix2d turned_root(const Eigen::Matrix2d& root_px_per_m,
                                          const Eigen::Matrix2d& neighbour_px_per_m);

/// Symmetric square root of a positive semi-definite matrix.
[[nodiscard]] Eigen::Matrix2d symmetric_root(const Eigen::Matrix2d& square);

/// How badly two neighbours fit together: the distance between `to` and the place that the mean of
/// both maps predicts (the trapezoid rule, exact for constant curvature), measured in steps.
[[nodiscard]] double step_error(const LocalMap& from, const LocalMap& to,
                                const Eigen::Vector2d& step_m);

/// The same for cloth that bends sharply somewhere in between, as over an edge: both maps agree
/// along the crease (J_to - J_from has rank one, which fixes the rotation) and the step is partly
/// the one map's and partly the other's. Returns the smallest miss over the place of the crease
/// and `to` with the rotation that gives it.
struct CreaseStep {
  double error = 0;
  LocalMap to;
};
[[nodiscard]] CreaseStep crease_step(const LocalMap& from, const LocalMap& to,
                                     const Eigen::Vector2d& step_m);

}  // namespace drape::detect
