// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace drape {

/// Homography that maps the points `from` to the points `to`: minimises the algebraic error on
/// normalised coordinates (Hartley 1997), with Frobenius norm 1 and a positive scale at the mean of
/// `from`. nullopt for fewer than four points or collinear ones.
[[nodiscard]] std::optional<Eigen::Matrix3d> homography(const std::vector<Eigen::Vector2d>& from,
                                                        const std::vector<Eigen::Vector2d>& to);

/// Homography of the unit square, corners (0, 0), (1, 0), (1, 1), (0, 1), to a quadrilateral
/// (Heckbert 1989). nullopt if three of its corners are collinear.
[[nodiscard]] std::optional<Eigen::Matrix3d> square_homography(
    const std::array<Eigen::Vector2d, 4>& corners);

/// Image of a point under a homography, and the derivative there.
[[nodiscard]] Eigen::Vector2d mapped(const Eigen::Matrix3d& map, const Eigen::Vector2d& point);
[[nodiscard]] Eigen::Matrix2d derivative_at(const Eigen::Matrix3d& map,
                                            const Eigen::Vector2d& point);

}  // namespace drape
