// SPDX-License-Identifier: Apache-2.0
#include "compare/meshes/obstacle_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "compare/metrics/dense.hpp"
#include "core/error.hpp"
#include "core/files/mesh_file.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Quad = std::array<Eigen::Vector3d, 4>;

void add_sphere(const Sphere& sphere, std::vector<Quad>& quads) {
  constexpr int kAround = 24, kUp = 12;
  const auto at = [&](int around, int up) -> Eigen::Vector3d {
    const double east = 2 * std::numbers::pi * around / kAround;
    const double north = std::numbers::pi * up / kUp - std::numbers::pi / 2;
    return sphere.centre_in_world +
           sphere.radius_m * Eigen::Vector3d(std::cos(north) * std::cos(east),
                                             std::cos(north) * std::sin(east), std::sin(north));
  };
  for (int up = 0; up < kUp; ++up)
    for (int around = 0; around < kAround; ++around)
      quads.push_back(
          {at(around, up), at(around + 1, up), at(around + 1, up + 1), at(around, up + 1)});
}

void add_box(const Box& box, std::vector<Quad>& quads) {
  constexpr int kPieces = 4;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const double side : {-0.5, 0.5}) {
      const auto at = [&](int i, int j) -> Eigen::Vector3d {
        Eigen::Vector3d part;
        part[axis] = side;
        part[u] = (static_cast<double>(i) / kPieces - 0.5) * (side < 0 ? -1 : 1);
        part[v] = static_cast<double>(j) / kPieces - 0.5;
        return box.world_from_box * part.cwiseProduct(box.size_m).eval();
      };
      for (int i = 0; i < kPieces; ++i)
        for (int j = 0; j < kPieces; ++j)
          quads.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
}

void add_cylinder(const Cylinder& cylinder, std::vector<Quad>& quads) {
  constexpr int kAround = 32;
  const auto at = [&](int around, double part, double end) -> Eigen::Vector3d {
    const double angle = 2 * std::numbers::pi * around / kAround;
    return cylinder.world_from_cylinder *
           Eigen::Vector3d(part * cylinder.radius_m * std::cos(angle),
                           part * cylinder.radius_m * std::sin(angle), end * cylinder.height_m);
  };
  for (int i = 0; i < kAround; ++i) {
    quads.push_back({at(i, 1, -0.5), at(i + 1, 1, -0.5), at(i + 1, 1, 0.5), at(i, 1, 0.5)});
    quads.push_back({at(i, 0, 0.5), at(i, 1, 0.5), at(i + 1, 1, 0.5), at(i + 1, 0, 0.5)});
    quads.push_back({at(i, 0, -0.5), at(i + 1, 1, -0.5), at(i, 1, -0.5), at(i, 0, -0.5)});
  }
}

/// A plane is unbounded; draws 300 mm around its point.
void add_plane(const Plane& plane, std::vector<Quad>& quads) {
  constexpr double kHalf_m = 0.15;
  const Eigen::Vector3d u = plane.normal_in_world.unitOrthogonal();
  const Eigen::Vector3d v = plane.normal_in_world.cross(u);
  const auto at = [&](double a, double b) -> Eigen::Vector3d {
    return plane.point_in_world + kHalf_m * (a * u + b * v);
  };
  quads.push_back({at(-1, -1), at(1, -1), at(1, 1), at(-1, 1)});
}

/// Adds triangles as quads with two equal corners. If the mesh file no longer exists, the picture
/// is drawn without the object.
void add_mesh(const MeshObject& object, std::vector<Quad>& quads) {
  try {
    const MeshFile mesh = read_mesh_file(object.file);
    for (const auto& [a, b, c] : mesh.triangles) {
      const auto at = [&](const MeshCorner& corner) -> Eigen::Vector3d {
        return object.world_from_mesh * (mesh.points[corner.point] * units::mm).eval();
      };
      quads.push_back({at(a), at(b), at(c), at(c)});
    }
  } catch (const Error&) {
    return;
  }
}

}  // namespace

std::vector<Quad> obstacle_quads(const Scene& scene) {
  std::vector<Quad> quads;
  for (const Obstacle& obstacle : scene.obstacles) {
    if (const auto* sphere = std::get_if<Sphere>(&obstacle)) add_sphere(*sphere, quads);
    if (const auto* box = std::get_if<Box>(&obstacle)) add_box(*box, quads);
    if (const auto* cylinder = std::get_if<Cylinder>(&obstacle)) add_cylinder(*cylinder, quads);
    if (const auto* plane = std::get_if<Plane>(&obstacle)) add_plane(*plane, quads);
    if (const auto* mesh = std::get_if<MeshObject>(&obstacle)) add_mesh(*mesh, quads);
  }
  return quads;
}

}  // namespace drape::compare
