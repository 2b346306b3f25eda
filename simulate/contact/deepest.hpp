// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// A flat piece of the sheet between its particles: its corners (world, m).
using SheetTriangle = std::array<Eigen::Vector3d, 3>;

/// Where a triangle enters an object deepest. The depth is a function of the corners alone: the
/// least over the triangle of the gap plus `steady_m` / 2 times the squared distance of the weights
/// from thirds. Outside a convex object the gap is convex over a flat piece, so that there is one
/// such place, and it moves continuously; the second part keeps that so where the piece lies along
/// a face. (A twisted cell can be as deep at two places, and a force that jumps between them never
/// comes to rest.)
struct DeepestPlace {
  static constexpr double steady_m = 1e-6;

  Eigen::Vector3d weights = Eigen::Vector3d::Constant(1.0 / 3);  ///< weights of the corners; sum 1
  double depth_m = 0;                                            ///< that least value
  double gap_m = 0;                                              ///< at the place
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< depth's derivative is weights * normal
};

/// True if no place of a piece can be deeper than its corners: a convex object shows all of them
/// the same plane.
[[nodiscard]] bool is_seen_flat(const Surroundings& surroundings, int shape,
                                std::span<const Eigen::Vector3d> corners);

[[nodiscard]] DeepestPlace deepest_place(const Surroundings& surroundings, int shape,
                                         const SheetTriangle& triangle);

/// Second derivative of an object's gap (1/m).
[[nodiscard]] Eigen::Matrix3d gap_curvature(const Surroundings& surroundings, int shape,
                                            const Eigen::Vector3d& p);

/// Minus the second derivative of the depth (1/m), corner by corner: what the object's curvature
/// takes, and what the place gives by sliding along.
struct DepthCurvature {
  Eigen::Matrix<double, 9, 9> bends = Eigen::Matrix<double, 9, 9>::Zero();   ///< negative part
  Eigen::Matrix<double, 9, 9> slides = Eigen::Matrix<double, 9, 9>::Zero();  ///< positive part
};
[[nodiscard]] DepthCurvature depth_curvature(const Surroundings& surroundings, int shape,
                                             const SheetTriangle& triangle,
                                             const DeepestPlace& deepest);

}  // namespace drape::simulate
