// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/checker/mesh_rest.hpp"
#include "simulate/checker/scene.hpp"

/// Contact of a mesh of cloth with the objects of a scene, and with itself.
namespace drape::simulate::checker {

constexpr Real kTouch_m = 1e-7L;       ///< from a point to the object that presses on it
constexpr Real kBetween_m = 0.5e-3L;   ///< depth between points that is believed ...
constexpr Real kBetweenOfSide = 0.1L;  ///< ... or this part of the longest side; as on the grid

[[nodiscard]] inline Point point_of(const Eigen::Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}

/// Rest of a force on a point after the nearest object that touches it pushed against it,
/// with friction up to the scene's coefficient of that push.
[[nodiscard]] Point left_by(const Objects& objects, const Point& point, Point force);

struct MeshDepths {
  Real of_points = 0;
  Real between = 0;
  Real through = 0;  ///< share of the thickness of an object, see through_of()
};

/// Pairs of a side and a triangle that pass through each other and have no corner in common.
[[nodiscard]] int crossings_of(const std::vector<Point>& corners,
                               const std::vector<std::array<int, 2>>& sides,
                               const std::vector<std::array<int, 3>>& triangles);
[[nodiscard]] int crossings_of(const MeshRest& rest);

}  // namespace drape::simulate::checker
