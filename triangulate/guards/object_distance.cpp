// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/object_distance.hpp"

#include <algorithm>
#include <cmath>

namespace drape::triangulate {
namespace {

using Eigen::Vector3d;

/// Distance from a box around the origin with edges rounded by `radius_m` (Quilez' rounded box).
double rounded_box(const Vector3d& point, const Vector3d& half_m, double radius_m) {
  const Vector3d q = point.cwiseAbs() - half_m + Vector3d::Constant(radius_m);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0) - radius_m;
}

struct Distance {
  Vector3d at;

  std::optional<double> operator()(const Sphere& body) const {
    return (at - body.centre_in_world).norm() - body.radius_m;
  }
  std::optional<double> operator()(const Box& body) const {
    return rounded_box(body.world_from_box.inverse() * at, 0.5 * body.size_m, body.edge_radius_m);
  }
  std::optional<double> operator()(const Cylinder& body) const {
    const Vector3d own = body.world_from_cylinder.inverse() * at;
    const Eigen::Vector2d q(own.head<2>().norm() - body.radius_m + body.edge_radius_m,
                            std::abs(own.z()) - 0.5 * body.height_m + body.edge_radius_m);
    return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0) - body.edge_radius_m;
  }
  std::optional<double> operator()(const Plane& body) const {
    return body.normal_in_world.dot(at - body.point_in_world);
  }
  std::optional<double> operator()(const MeshObject&) const { return std::nullopt; }
};

}  // namespace

std::optional<double> distance_to(const Obstacle& object, const Vector3d& point_in_world) {
  return std::visit(Distance{point_in_world}, object);
}

}  // namespace drape::triangulate
