// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "core/scene.hpp"

namespace drape {

/// Amount by which a point in the body's frame exceeds the body shrunk by its edge radius: per axis
/// for a box, radially and axially for a cylinder.
[[nodiscard]] Eigen::Vector3d beyond(const Box& box, const Eigen::Vector3d& in_box);
[[nodiscard]] Eigen::Vector2d beyond(const Cylinder& body, const Eigen::Vector3d& in_cylinder);

/// Signed distance (m) of a world point from a body, negative inside.
[[nodiscard]] double distance_to(const Sphere& sphere, const Eigen::Vector3d& point);
[[nodiscard]] double distance_to(const Box& box, const Eigen::Vector3d& point);
[[nodiscard]] double distance_to(const Cylinder& body, const Eigen::Vector3d& point);
[[nodiscard]] double distance_to(const Plane& plane, const Eigen::Vector3d& point);

/// Signed distance from one of a scene's objects; nullopt for a mesh, whose file is not read here.
[[nodiscard]] std::optional<double> distance_to(const Obstacle& object,
                                                const Eigen::Vector3d& point);

/// A point of a body's surface with its unit normal, which points out of the body.
struct SurfaceCorner {
  Eigen::Vector3d point, normal;
};
/// Four corners, counter-clockwise seen from outside.
using SurfaceQuad = std::array<SurfaceCorner, 4>;

/// Surface of a body with sharp edges: `around` quads around a sphere or cylinder, proportionally
/// many along the other directions. A plane is a square of side `plane_m` around its point; a mesh
/// has none, since its file is not read here.
[[nodiscard]] std::vector<SurfaceQuad> surface_of(const Obstacle& object, int around,
                                                  double plane_m);

}  // namespace drape
