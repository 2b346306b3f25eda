// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace drape {

/// Projective map of a plane that takes the points `from` to the points `to`: smallest algebraic
/// error on normalised coordinates (Hartley 1997), of Frobenius norm 1, with a scale above 0 at the
/// mean of `from`. Nothing below four points or where they lie on a line.
[[nodiscard]] std::optional<Eigen::Matrix3d> homography(const std::vector<Eigen::Vector2d>& from,
                                                        const std::vector<Eigen::Vector2d>& to);

/// Projective map of the unit square, corners (0, 0), (1, 0), (1, 1), (0, 1), to a quadrangle
/// (Heckbert 1989). Nothing where three of its corners lie on a line.
[[nodiscard]] std::optional<Eigen::Matrix3d> square_homography(
    const std::array<Eigen::Vector2d, 4>& corners);

/// A point under a projective map, and the map's derivative there.
[[nodiscard]] Eigen::Vector2d mapped(const Eigen::Matrix3d& map, const Eigen::Vector2d& point);
[[nodiscard]] Eigen::Matrix2d derivative_at(const Eigen::Matrix3d& map,
                                            const Eigen::Vector2d& point);

}  // namespace drape
