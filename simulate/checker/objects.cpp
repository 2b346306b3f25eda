// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/objects.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace drape::simulate::checker {
namespace {

// m; solvers round positions of objects to 0.12 nm, so the surface may be off by this much.
constexpr Real kPlaceRounding = 0.2e-9L;
constexpr Real kCut = 1e-12L;  // relative to a force; below this no other normal is tried
constexpr Real kStep = 50;     // factor by which the change of the normal is magnified

/// Coordinates of p in an object's frame.
Point in_frame(const WorldFromObject& frame, const Point& p) {
  Point q{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      q[i] += Real(frame.rotation(j, i)) * (p[j] - Real(frame.translation_m[j]));
  }
  return q;
}

/// Distance from a body shrunk by `radius` along each direction, then inflated by it.
Real rounded(Real a, Real b, Real c, Real radius) {
  const Real outside = length({std::max<Real>(a, 0), std::max<Real>(b, 0), std::max<Real>(c, 0)});
  return outside + std::min<Real>(0, std::max({a, b, c})) - radius;
}

struct Gap {
  const Objects& objects;
  std::size_t k;
  const Point& p;

  Real operator()(const Sphere& s) const {
    return length(minus(p, point_of(s.centre_in_world))) - Real(s.radius_m);
  }
  Real operator()(const Box& box) const {
    const Point q = in_frame(box.world_from_box, p);
    Point over{};
    for (int i = 0; i < 3; ++i)
      over[i] = std::abs(q[i]) - Real(box.size_m[i]) / 2 + Real(box.edge_radius_m);
    return rounded(over[0], over[1], over[2], box.edge_radius_m);
  }
  Real operator()(const Cylinder& body) const {
    const Point q = in_frame(body.world_from_cylinder, p);
    const Real across = length({q[0], q[1], 0}) - Real(body.radius_m) + Real(body.edge_radius_m);
    const Real along = std::abs(q[2]) - Real(body.height_m) / 2 + Real(body.edge_radius_m);
    return rounded(across, along, std::min({across, along, Real(0)}), body.edge_radius_m);
  }
  Real operator()(const Plane& plane) const {
    return dot(point_of(plane.normal_in_world), minus(p, point_of(plane.point_in_world)));
  }
  Real operator()(const MeshObject&) const {
    return objects.meshes[k]->gap_m(
        0, {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
  }
};

/// True if the object has edges with a radius below the depth of pressed places.
bool is_sharp(const Objects& objects, std::size_t k) {
  if (k == objects.count()) return false;
  const Obstacle& object = objects.scene->obstacles[k];
  const auto* box = std::get_if<Box>(&object);
  const auto* cylinder = std::get_if<Cylinder>(&object);
  return std::holds_alternative<MeshObject>(object) ||
         (box != nullptr && box->edge_radius_m < double(kSunk_m)) ||
         (cylinder != nullptr && cylinder->edge_radius_m < double(kSunk_m));
}

/// Extents along the principal axes, smallest first.
Point extents_of(const std::vector<Eigen::Vector3d>& corners) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : corners) middle += p / static_cast<double>(corners.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : corners) spread += (p - middle) * (p - middle).transpose();
  const Eigen::Matrix3d axes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
  Point extents{};
  for (int axis = 0; axis < 3; ++axis) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const Eigen::Vector3d& p : corners) {
      low = std::min(low, axes.col(axis).dot(p));
      high = std::max(high, axes.col(axis).dot(p));
    }
    extents[static_cast<std::size_t>(axis)] = high - low;
  }
  std::sort(extents.begin(), extents.end());
  return extents;
}

/// Normals of faces and edges near a place; empty for an object without edges.
std::vector<Point> sharp_normals_of(const Objects& objects, std::size_t k, const Point& p) {
  std::vector<Point> normals;
  for (int cell = 0; is_sharp(objects, k) && cell < 27; ++cell) {
    const Point off{Real(cell % 3 - 1), Real(cell / 3 % 3 - 1), Real(cell / 9 - 1)};
    normals.push_back(normal_of(objects, k, plus(p, off, kSunk_m)));
  }
  return normals;
}

/// Angle (rad) by which the normal rotates if the object moves by its rounding.
Real turn_of_normal(const Objects& objects, std::size_t k, const Point& p, const Point& normal) {
  Real most = 0;
  for (int axis = 0; axis < 3; ++axis) {
    Point beside = p;
    beside[axis] += kStep * kPlaceRounding;
    most = std::max(most, length(minus(normal_of(objects, k, beside), normal)));
  }
  return most / kStep;
}

}  // namespace

Objects::Objects(const Scene& objects_of) : scene(&objects_of) {
  for (const Obstacle& obstacle : objects_of.obstacles) {
    meshes.emplace_back();
    mesh_extents.emplace_back();
    mesh_middle.emplace_back();
    if (const auto* mesh = std::get_if<MeshObject>(&obstacle)) {
      meshes.back() = std::make_shared<Surroundings>();
      meshes.back()->add(*mesh);
      const PlacedMesh& placed = *meshes.back()->mesh(0);
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      for (const Eigen::Vector3d& p : placed.mesh->corners())
        middle += placed.world_from_mesh * p / static_cast<double>(placed.mesh->corners().size());
      mesh_middle.back() = {middle.x(), middle.y(), middle.z()};
      mesh_extents.back() = extents_of(placed.mesh->corners());
    }
  }
}

Real gap_of(const Objects& objects, std::size_t k, const Point& p) {
  if (k == objects.count()) return p[2] - Real(objects.scene->table_z_m);
  return std::visit(Gap{objects, k, p}, objects.scene->obstacles[k]);
}

Point normal_of(const Objects& objects, std::size_t k, const Point& p) {
  // Distances from meshes are doubles, whose differences need a longer step.
  const bool mesh = k < objects.meshes.size() && objects.meshes[k] != nullptr;
  const Real step = mesh ? 1e-6L : 1e-9L;
  Point normal{};
  for (int axis = 0; axis < 3; ++axis) {
    Point before = p, after = p;
    before[axis] -= step;
    after[axis] += step;
    normal[axis] = gap_of(objects, k, after) - gap_of(objects, k, before);
  }
  const Real size = length(normal);
  if (!(size > 0)) return {0, 0, 1};  // in the middle of an object, where the normal is undefined
  for (Real& n : normal) n /= size;
  return normal;
}

Real allowed_between_m(const Objects& objects, std::size_t k) {
  if (k == objects.count()) return kSunk_m;
  const Obstacle& object = objects.scene->obstacles[k];
  Real radius = 0;
  if (std::holds_alternative<Plane>(object)) return kSunk_m;
  if (const auto* ball = std::get_if<Sphere>(&object)) radius = ball->radius_m;
  if (const auto* box = std::get_if<Box>(&object)) radius = box->edge_radius_m;
  if (const auto* rod = std::get_if<Cylinder>(&object)) radius = rod->edge_radius_m;
  if (radius <= kFarthest_m) return kSunk_m + kFarthest_m;
  return kSunk_m + radius - std::sqrt(radius * radius - kFarthest_m * kFarthest_m);
}

Point within_cone(const Point& force, const Point& normal, Real friction) {
  const Real pressing = std::max<Real>(0, dot(force, normal));
  const Point along = plus(force, normal, -pressing);
  const Real part = std::min<Real>(1, friction * pressing / std::max<Real>(length(along), 1e-300L));
  return plus(times(pressing, normal), along, part);
}

std::optional<Point> pushed_by(const Objects& objects, std::size_t k, const Point& p, Real friction,
                               const Eigen::Vector3d& stated_n) {
  if (gap_of(objects, k, p) > kTouch_m) return std::nullopt;
  const Point force = point_of(stated_n), normal = normal_of(objects, k, p);
  Point kept = within_cone(force, normal, friction + turn_of_normal(objects, k, p, normal));
  Real least = length(minus(force, kept));
  if (least <= kCut * length(force)) return kept;
  for (const Point& other : sharp_normals_of(objects, k, p)) {
    const Point cut = within_cone(force, other, friction);
    const Real lost = length(minus(force, cut));
    if (lost >= least) continue;
    least = lost;
    kept = cut;
  }
  return kept;
}

}  // namespace drape::simulate::checker
