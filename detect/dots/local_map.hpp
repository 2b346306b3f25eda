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

/// Map at a dot, from the symmetric root of its ellipse's shape divided by the dot's radius (px per
/// m): the ellipse J J^T fixes J up to a rotation within the print, and the rotation is taken that
/// brings J closest to a neighbour's map.
[[nodiscard]] Eigen::Matrix2d turned_root(const Eigen::Matrix2d& root_px_per_m,
                                          const Eigen::Matrix2d& neighbour_px_per_m);

/// Symmetric square root of a positive semi-definite matrix.
[[nodiscard]] Eigen::Matrix2d symmetric_root(const Eigen::Matrix2d& square);

/// How badly two neighbours fit together: the distance between `to` and the place that the mean of
/// both maps predicts (the trapezoid rule, exact for constant curvature), measured in steps.
[[nodiscard]] double step_error(const LocalMap& from, const LocalMap& to,
                                const Eigen::Vector2d& step_m);

}  // namespace drape::detect
