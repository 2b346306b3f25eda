// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "simulate/fabric/laws.hpp"
#include "simulate/objects/cloth_shape.hpp"
#include "simulate/objects/contact_forces.hpp"

namespace drape::simulate {

/// A point of the cloth that a pin holds.
struct HeldPoint {
  Eigen::Vector2d material_m;            ///< (warp, weft)
  std::optional<Eigen::Vector3d> place;  ///< absent: where it is
};

/// A triangle mesh that is said to rest, in plain numbers: with a scene on its objects, pins and
/// clamps, else in a drapemeter, its middle held flat between two discs at z = 0, warp along x, no
/// cloth in the cylinder below them.
struct MeshRest {
  ClothShape shape;
  ClothLaws laws;
  ClothMemory memory;            ///< slip of laws.friction: bending by triangle, shear by point
  double disc_radius_m = 0;      ///< the drapemeter's; its material coordinates are from the middle
  const Scene* scene = nullptr;  ///< objects, table, clamps and friction; absent: a drapemeter
  std::vector<HeldPoint> pins;
  /// Forces of objects on places of facets of the surface (checker/surface.hpp), by their nodes:
  /// the points, then the middles of the sides. Forces of one layer on another by nodes of both.
  std::vector<ContactForce> contact_forces;
  double layers_apart_m = 0;  ///< layers press when they are nearer than this; 0: they do not press
  Eigen::Vector3d gravity_m_per_s2 = {0, 0, -9.80665};
  double residual_tolerance = 0;  ///< claimed residual, in mean weights of a point
  /// Largest strain (warp, weft) that is believed, see strain_limits().
  Eigen::Vector2d most_strain = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  std::vector<Eigen::Vector2d> asked_m = {};  ///< material points whose places are asked for
};

/// Extremes of a mesh's strains: stretch and shear at the points, from the mean metric of the
/// triangles around, curvature in the triangles.
struct MeshStrains {
  Eigen::Vector2d least = Eigen::Vector2d::Constant(1e9), most = -least;  ///< warp, weft
  double shear_most_rad = 0, curvature_most_per_m = 0;
};

struct MeshJudgement {
  double residual = 0;       ///< largest force left on a free point, in mean weights of a point
  double side_residual = 0;  ///< the same of the sides' moments, over the mean length of a side
  double deepest_m = 0;  ///< deepest cloth in the cylinder below or above the discs, or in objects
  int crossings = 0;     ///< pairs of an edge and a facet without a common corner
  int places_pressed = 0;             ///< stated contact forces
  double energy_j = 0;                ///< internal
  double hold_error_m = 0;            ///< largest distance of a held point from its place
  std::optional<double> to_object_m;  ///< least distance of the surface's nodes
  double to_table_m = 0;              ///< the same
  std::optional<double> to_itself_m;  ///< least distance of layers that press on each other
  MeshStrains strains;
  std::vector<std::optional<Eigen::Vector3d>> places;  ///< MeshRest::asked_m; absent: beside it
  std::vector<std::string> refusals;                   ///< empty: accepted

  [[nodiscard]] bool accepted() const { return refusals.empty(); }
};

/// Judges such a rest with code of its own, in long double: curvature by Green's theorem over each
/// triangle's sides, forces as derivatives of its energy by dual numbers, pins and clamps where
/// they must be, friction elements within their limits, stated forces of objects and layers cut to
/// their cones of friction, what they and the discs' cylinder leave on each free point, and cloth
/// that passes through objects or through cloth. Between points the cloth may lie as deep in the
/// cylinder as the longest side is a chord of it, in objects as allowed_between_m() says.
[[nodiscard]] MeshJudgement judge_mesh(const MeshRest& rest);

}  // namespace drape::simulate
