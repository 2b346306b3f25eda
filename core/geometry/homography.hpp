// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace drape {

/// Projective map of a plane that takes the points `from` to the points `to`: smallest algebraic
/// error on normalised coordinates (Hartley 1997), of Frobenius norm 1, with a scale above 0 at the
/// mean of `from`. Nothing below four points or where they lie on a line.
[[nodiscard]] std::optional<Eigen::Matrix3d> homography(const std::vector<Eigen::Vector2d>& from,
                                                        const std::vector<Eigen::Vector2d>& to);

}  // namespace drape
