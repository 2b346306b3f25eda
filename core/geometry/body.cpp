// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/body.hpp"

#include <algorithm>

namespace drape {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d beyond(const Box& box, const Vector3d& in_box) {
  return in_box.cwiseAbs() - 0.5 * box.size_m + Vector3d::Constant(box.edge_radius_m);
}

Vector2d beyond(const Cylinder& body, const Vector3d& in_cylinder) {
  return {in_cylinder.head<2>().norm() - body.radius_m + body.edge_radius_m,
          std::abs(in_cylinder.z()) - 0.5 * body.height_m + body.edge_radius_m};
}

double distance_to(const Sphere& sphere, const Vector3d& point) {
  return (point - sphere.centre_in_world).norm() - sphere.radius_m;
}

double distance_to(const Box& box, const Vector3d& point) {
  const Vector3d d = beyond(
      box, box.world_from_box.rotation.transpose() * (point - box.world_from_box.translation_m));
  return d.cwiseMax(0.0).norm() + std::min(0.0, d.maxCoeff()) - box.edge_radius_m;
}

double distance_to(const Cylinder& body, const Vector3d& point) {
  const Vector2d d = beyond(body, body.world_from_cylinder.rotation.transpose() *
                                      (point - body.world_from_cylinder.translation_m));
  return d.cwiseMax(0.0).norm() + std::min(0.0, d.maxCoeff()) - body.edge_radius_m;
}

double distance_to(const Plane& plane, const Vector3d& point) {
  return plane.normal_in_world.dot(point - plane.point_in_world);
}

std::optional<double> distance_to(const Obstacle& object, const Vector3d& point) {
  return std::visit(
      [&](const auto& body) -> std::optional<double> {
        if constexpr (std::is_same_v<std::decay_t<decltype(body)>, MeshObject>)
          return std::nullopt;
        else
          return distance_to(body, point);
      },
      object);
}

}  // namespace drape
