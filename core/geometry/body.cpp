// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/body.hpp"

#include <algorithm>
#include <cmath>

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

namespace {

/// Quads of each object, by surfaces over two parameters from 0 to 1.
struct SurfaceQuads {
  int around;
  double plane_m;
  std::vector<SurfaceQuad> quads = {};

  template <class Place>
  void add_patch(int across, int up, const Place& place) {
    const auto corner = [&](int i, int j) -> SurfaceCorner {
      return place(static_cast<double>(i) / across, static_cast<double>(j) / up);
    };
    for (int j = 0; j < up; ++j)
      for (int i = 0; i < across; ++i)
        quads.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)});
  }
  static Vector3d turned(double part) {
    const double angle = 2 * std::numbers::pi * part;
    return {std::cos(angle), std::sin(angle), 0};
  }

  void operator()(const Sphere& sphere) {
    add_patch(around, around / 2, [&](double u, double v) {
      const double up = std::numbers::pi * (v - 0.5);
      const Vector3d n = std::cos(up) * turned(u) + std::sin(up) * Vector3d::UnitZ();
      return SurfaceCorner{sphere.centre_in_world + sphere.radius_m * n, n};
    });
  }
  void operator()(const Box& box) {
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0})
        add_patch(around / 6, around / 6, [&](double u, double v) {
          Vector3d part;
          part[axis] = side / 2;
          part[(axis + 1) % 3] = side * (u - 0.5);
          part[(axis + 2) % 3] = v - 0.5;
          return SurfaceCorner{box.world_from_box * part.cwiseProduct(box.size_m),
                               box.world_from_box.rotation * Vector3d(side * Vector3d::Unit(axis))};
        });
  }
  void operator()(const Cylinder& body) {
    const auto& pose = body.world_from_cylinder;
    const Vector3d axis(0, 0, body.height_m);
    add_patch(around, around / 12, [&](double u, double v) {
      return SurfaceCorner{pose * Vector3d(body.radius_m * turned(u) + (v - 0.5) * axis),
                           pose.rotation * turned(u)};
    });
    for (const double side : {-1.0, 1.0})
      add_patch(around, around / 16, [&](double u, double v) {
        const double radius = body.radius_m * (side < 0 ? v : 1 - v);
        return SurfaceCorner{pose * Vector3d(radius * turned(u) + side / 2 * axis),
                             pose.rotation * Vector3d(side * Vector3d::UnitZ())};
      });
  }
  void operator()(const Plane& plane) {
    const Vector3d u = plane.normal_in_world.unitOrthogonal(), v = plane.normal_in_world.cross(u);
    add_patch(around / 2, around / 2, [&](double a, double b) {
      return SurfaceCorner{plane.point_in_world + plane_m * ((a - 0.5) * u + (b - 0.5) * v),
                           plane.normal_in_world};
    });
  }
  void operator()(const MeshObject&) {}
};

}  // namespace

std::vector<SurfaceQuad> surface_of(const Obstacle& object, int around, double plane_m) {
  SurfaceQuads all{around, plane_m};
  std::visit(all, object);
  return all.quads;
}

}  // namespace drape
