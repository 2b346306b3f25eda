// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// A piece of the sheet between its particles: a grid line piece (2 corners) or a bilinear cell (4,
/// corners 00, 01, 10, 11).
struct SheetPiece {
  int corners = 2;
  std::array<Eigen::Vector3d, 4> at{zero(), zero(), zero(), zero()};  ///< world, m

  static Eigen::Vector3d zero() { return Eigen::Vector3d::Zero(); }
};

/// Where a piece enters an object deepest. The depth is a function of the corners alone: the least
/// over the piece of the gap plus `steady_m` / 2 times the squared distance from its middle, in
/// fractions of the piece. The second part makes the place unique and its motion smooth where the
/// piece lies along a face.
struct DeepestPlace {
  static constexpr double steady_m = 1e-6;

  std::array<double, 4> weight{};  ///< of the corners
  double depth_m = 0;              ///< that least value; negative inside
  double gap_m = 0;                ///< at the place
  Eigen::Vector3d normal =
      Eigen::Vector3d::UnitZ();     ///< of the object there; depth's derivative is weight * normal
  Eigen::Vector2d place{0.5, 0.5};  ///< fractions along the first and the second direction
};

/// Whether no place of the piece can be deeper than its corners: a convex object shows all of them
/// the same plane.
[[nodiscard]] bool is_seen_flat(const Surroundings& surroundings, int shape,
                                const SheetPiece& piece);

[[nodiscard]] DeepestPlace deepest_place(const Surroundings& surroundings, int shape,
                                         const SheetPiece& piece);

/// Second derivative of an object's gap (1/m).
[[nodiscard]] Eigen::Matrix3d gap_curvature(const Surroundings& surroundings, int shape,
                                            const Eigen::Vector3d& p);

/// Minus the second derivative of the depth (1/m), corner by corner: what the object's curvature
/// takes, and what the place gives by sliding along.
struct DepthCurvature {
  Eigen::Matrix<double, 12, 12> bends = Eigen::Matrix<double, 12, 12>::Zero();   ///< negative part
  Eigen::Matrix<double, 12, 12> slides = Eigen::Matrix<double, 12, 12>::Zero();  ///< positive part
};
[[nodiscard]] DepthCurvature depth_curvature(const Surroundings& surroundings, int shape,
                                             const SheetPiece& piece, const DeepestPlace& deepest);

}  // namespace drape::simulate
