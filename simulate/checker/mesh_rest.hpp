// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "simulate/fabric/laws.hpp"
#include "simulate/objects/contact_forces.hpp"

namespace drape::simulate {

/// A triangle mesh that is said to rest, in plain numbers: with a scene on its objects and pins,
/// else in a drapemeter, its middle held flat between two discs at z = 0, warp along x, no cloth in
/// the cylinder below them.
struct MeshRest {
  std::vector<Eigen::Vector2d> material_m;    ///< (warp, weft) from the middle
  std::vector<std::array<int, 3>> triangles;  ///< turning from warp towards weft
  std::vector<std::array<int, 2>> sides;      ///< from < to; each once
  std::vector<Eigen::Vector3d> points_m;      ///< in space
  std::vector<Eigen::Vector3d> of_sides;      ///< derivative along each side's left normal
  ClothLaws laws;
  ClothMemory memory;        ///< where laws.friction is; of bending by triangle, of shear by point
  double disc_radius_m = 0;  ///< the drapemeter's
  const Scene* scene = nullptr;  ///< objects, table and friction; absent: a drapemeter
  std::vector<int> pinned;       ///< points that the scene holds ...
  std::vector<Eigen::Vector3d> pinned_in_world;  ///< ... and where
  /// Forces of objects on places of triangles, by weights of their corners in `triangles`' order,
  /// and to points; a place by corners is that of the surface (checker/mesh_surface.hpp) there.
  /// What layers do to each other by points of that surface: those of the mesh, then middles of
  /// sides.
  std::vector<ContactForce> contact_forces;
  double layers_apart_m = 0;  ///< layers press when they are nearer than this; 0: they do not press
  Eigen::Vector3d gravity_m_per_s2 = {0, 0, -9.80665};
  double residual_tolerance = 0;  ///< that was claimed, in mean weights of a point
};

struct MeshJudgement {
  double residual = 0;       ///< largest force left on a free point, in mean weights of a point
  double side_residual = 0;  ///< the same of the sides' moments, over the mean length of a side
  double deepest_m = 0;  ///< deepest cloth in the cylinder below or above the discs, or in objects
  int crossings = 0;     ///< pairs of a side and a triangle without a common corner
  double energy_j = 0;   ///< internal
  std::vector<std::string> refusals;  ///< empty: accepted

  [[nodiscard]] bool accepted() const { return refusals.empty(); }
};

/// Judges such a rest with code of its own, in long double: curvature by Green's theorem over each
/// triangle's sides, forces as derivatives of its energy by dual numbers, held points where they
/// must be, friction elements within their limits, what is left on each free point after what the
/// cylinder or objects can push and hold by friction, and cloth that passes through them or through
/// cloth. Between points the cloth may lie as deep in the cylinder as the longest side is a chord
/// of it, in objects as on the particle grid.
[[nodiscard]] MeshJudgement judge_mesh(const MeshRest& rest);

}  // namespace drape::simulate
