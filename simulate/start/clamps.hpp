// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "simulate/mesh/material_mesh.hpp"

namespace drape::simulate {

/// A line of the cloth along warp or weft that a clamp holds: its points on a straight line in
/// space, and the direction in which the cloth leaves it.
struct HeldLine {
  Eigen::Vector2d from_m, to_m;  ///< material
  Eigen::Vector3d from, to;      ///< places
  /// Derivatives of the place along warp and weft. The one along the line is that of the places.
  /// The one across it is held by mesh sides on the line: a unit vector, for the cloth's strain
  /// there (some 1e-4) bends nothing.
  Eigen::Vector3d x_u, x_v;

  [[nodiscard]] Eigen::Vector3d place(const Eigen::Vector2d& material_m) const;
  /// True if a material point lies on the line.
  [[nodiscard]] bool holds(const Eigen::Vector2d& material_m) const;
};

/// The clamps of a scene, in its frame and order. Cloth leaves a clamp towards larger coordinates
/// in its direction; towards smaller ones alone where the clamp is a far hem. Throws
/// Error(bad_input) for a clamp that is not on the cloth, has no length, crosses the threads or is
/// left along itself, and where two clamps, or a clamp and a pin, hold a point in two places.
[[nodiscard]] std::vector<HeldLine> held_lines(const Scene& scene, const Print& print,
                                               const ClothOutline& outline);

/// A warning for each two clamps that meet where the cloth would have to kink.
[[nodiscard]] std::vector<std::string> warnings_of_clamps(const std::vector<HeldLine>& lines);

}  // namespace drape::simulate
