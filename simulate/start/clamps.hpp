// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "simulate/mesh/material_mesh.hpp"

namespace drape::simulate {

/// A line of the cloth along warp or weft, held by a clamp: its points on a straight line in space,
/// and the direction in which the cloth leaves.
struct HeldLine {
  Eigen::Vector2d from_m, to_m;  ///< material coordinates
  Eigen::Vector3d from, to;      ///< positions of the ends
  /// Derivatives of the position along warp and weft. The one along the line follows from the ends.
  /// The one across it is held at mesh sides on the line and taken as a unit vector, since the
  /// cloth's strain there (about 1e-4) does not affect bending.
  Eigen::Vector3d x_u, x_v;

  [[nodiscard]] Eigen::Vector3d place(const Eigen::Vector2d& material_m) const;
  /// True if a material point lies on the line.
  [[nodiscard]] bool holds(const Eigen::Vector2d& material_m) const;
};

/// The clamps of a scene, in its frame and order. Cloth leaves a clamp in the stated direction
/// towards larger coordinates; towards smaller ones only at a far hem. Throws Error(bad_input) for
/// a clamp that is not on the cloth, has no length, crosses the threads or has a direction along
/// itself, and for two clamps, or a clamp and a pin, that hold a point in two places.
[[nodiscard]] std::vector<HeldLine> held_lines(const Scene& scene, const Print& print,
                                               const ClothOutline& outline);

/// A warning for each pair of clamps that meet at a kink of the cloth.
[[nodiscard]] std::vector<std::string> warnings_of_clamps(const std::vector<HeldLine>& lines);

}  // namespace drape::simulate
