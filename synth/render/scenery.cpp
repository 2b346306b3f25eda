// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.hpp"
#include "core/units.hpp"
#include "synth/render/caster.hpp"

namespace drape::synth {
namespace {

using Eigen::Vector3d;
using units::mm;

constexpr double object_reflectance = 0.5;
constexpr double table_reflectance = 0.3;

// A sharp corner shrunk by this many edge radii relative to its faces touches the rounded corner: 1
// - 1 / sqrt(3).
constexpr double corner_fraction = 0.423;

struct Corner {
  Vector3d point, normal;
};

void draw_in(Sphere& sphere, double by_m) {
  sphere.radius_m = std::max(0.0, sphere.radius_m - by_m);
}

void draw_in(Box& box, double by_m) {
  const double in_m = by_m + corner_fraction * box.edge_radius_m;
  box.size_m = (box.size_m.array() - 2 * in_m).max(0.0);
}

void draw_in(Cylinder& cylinder, double by_m) {
  const double in_m = by_m + corner_fraction * cylinder.edge_radius_m;
  cylinder.radius_m = std::max(0.0, cylinder.radius_m - in_m);
  cylinder.height_m = std::max(0.0, cylinder.height_m - 2 * in_m);
}

void draw_in(Plane& plane, double by_m) {
  plane.point_in_world -= by_m * plane.normal_in_world;
}

void draw_in(MeshObject&, double) {}

void add_quad(std::vector<Triangle>& all, const std::array<Corner, 4>& c, double reflectance) {
  for (const auto& [i, j, k] : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
    Triangle t;
    t.corners_in_world = {c[i].point, c[j].point, c[k].point};
    t.normals_in_world = {c[i].normal, c[j].normal, c[k].normal};
    t.reflectance = reflectance;
    all.push_back(t);
  }
}

/// Triangulates a surface over parameters 0..1 in `across` x `down` pieces.
template <class Place>
void add_patch(std::vector<Triangle>& all, int across, int down, double reflectance,
               const Place& place) {
  const auto at = [&](int i, int j) {
    return place(i / static_cast<double>(across), j / static_cast<double>(down));
  };
  for (int j = 0; j < down; ++j) {
    for (int i = 0; i < across; ++i)
      add_quad(all, {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)}, reflectance);
  }
}

constexpr double turn = 2 * std::numbers::pi;

void add(std::vector<Triangle>& all, const Sphere& sphere) {
  add_patch(all, 96, 48, object_reflectance, [&](double u, double v) {
    const double a = turn * u, b = turn / 2 * v;
    const Vector3d n(std::cos(a) * std::sin(b), std::sin(a) * std::sin(b), std::cos(b));
    return Corner{sphere.centre_in_world + sphere.radius_m * n, n};
  });
}

void add(std::vector<Triangle>& all, const Box& box) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      add_patch(all, 8, 8, object_reflectance, [&](double u, double v) {
        Vector3d point;
        point[axis] = side / 2;
        point[(axis + 1) % 3] = u - 0.5;
        point[(axis + 2) % 3] = v - 0.5;
        const Vector3d normal = side * Vector3d::Unit(axis);
        return Corner{box.world_from_box * point.cwiseProduct(box.size_m),
                      box.world_from_box.rotation * normal};
      });
    }
  }
}

void add(std::vector<Triangle>& all, const Cylinder& cylinder) {
  const auto& pose = cylinder.world_from_cylinder;
  add_patch(all, 96, 8, object_reflectance, [&](double u, double v) {
    const Vector3d n(std::cos(turn * u), std::sin(turn * u), 0);
    const Vector3d up((v - 0.5) * cylinder.height_m * Vector3d::UnitZ());
    return Corner{pose * (cylinder.radius_m * n + up), pose.rotation * n};
  });
  for (const double side : {-1.0, 1.0}) {
    add_patch(all, 96, 6, object_reflectance, [&](double u, double v) {
      const Vector3d n(std::cos(turn * u), std::sin(turn * u), 0);
      const Vector3d up(side / 2 * cylinder.height_m * Vector3d::UnitZ());
      return Corner{pose * (v * cylinder.radius_m * n + up),
                    pose.rotation * Vector3d(side * Vector3d::UnitZ())};
    });
  }
}

/// A plane is unbounded; renders one metre around its point.
void add(std::vector<Triangle>& all, const Plane& plane) {
  const Vector3d u = plane.normal_in_world.unitOrthogonal(), v = plane.normal_in_world.cross(u);
  add_patch(all, 50, 50, object_reflectance, [&](double a, double b) {
    return Corner{plane.point_in_world + 1000 * mm * ((a - 0.5) * u + (b - 0.5) * v),
                  plane.normal_in_world};
  });
}

[[noreturn]] void add(std::vector<Triangle>&, const MeshObject& object) {
  throw bad_input("a mesh among the scene's objects cannot be rendered",
                  {.file = object.file.string()},
                  "put spheres, boxes or cylinders in its place, or render the set's folds, which "
                  "lie on the table alone, without --sheet");
}

}  // namespace

std::vector<Triangle> table_triangles(double z_m) {
  std::vector<Triangle> all;
  add_patch(all, 50, 50, table_reflectance, [&](double u, double v) {
    return Corner{Vector3d((u - 0.5) * 1000 * mm, (v - 0.5) * 1000 * mm, z_m), Vector3d::UnitZ()};
  });
  return all;
}

Scene drawn_in(Scene scene, double by_m) {
  scene.table_z_m -= by_m;
  for (Obstacle& obstacle : scene.obstacles)
    std::visit([&](auto& object) { draw_in(object, by_m); }, obstacle);
  return scene;
}

std::vector<Triangle> triangles_of(const Scene& scene) {
  std::vector<Triangle> all = table_triangles(scene.table_z_m);
  for (const Obstacle& obstacle : scene.obstacles)
    std::visit([&](const auto& object) { add(all, object); }, obstacle);
  return all;
}

}  // namespace drape::synth
