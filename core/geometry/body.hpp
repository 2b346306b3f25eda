// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

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

}  // namespace drape
