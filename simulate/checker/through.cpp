// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <variant>

#include "simulate/checker/objects.hpp"

namespace drape::simulate::checker {
namespace {

/// Minimum over 0 .. 1 of a unimodal function, and its position.
template <class Function>
std::pair<Real, Real> least_of(Function value) {
  constexpr Real kGolden = 0.618033988749894848L;
  Real low = 0, high = 1, one = 1 - kGolden, two = kGolden;
  Real at_one = value(one), at_two = value(two);
  for (int step = 0; step < 18; ++step) {
    if (at_one < at_two) {
      high = std::exchange(two, one);
      at_two = at_one;
      one = high - kGolden * (high - low);
      at_one = value(one);
    } else {
      low = std::exchange(one, two);
      at_one = at_two;
      two = low + kGolden * (high - low);
      at_two = value(two);
    }
  }
  return at_one < at_two ? std::pair{at_one, one} : std::pair{at_two, two};
}

/// Distance from a place inside a convex object to its surface along a direction.
Real out_of(const Objects& objects, std::size_t k, const Point& p, const Point& direction) {
  Real inside = 0, outside = 1e-5L;
  while (gap_of(objects, k, plus(p, direction, outside)) < 0) outside *= 2;
  for (int halving = 0; halving < 40; ++halving) {
    const Real middle = (inside + outside) / 2;
    (gap_of(objects, k, plus(p, direction, middle)) < 0 ? inside : outside) = middle;
  }
  return outside;
}

/// Thickness of a convex object near a place inside it. Nearby places are used, because the normal
/// is undefined in the middle of an object.
Real thickness_at(const Objects& objects, std::size_t k, const Point& p) {
  constexpr Real kAbout = 1e-5L;
  Real least = HUGE_VALL;
  for (const int axis : {0, 1, 2}) {
    for (const Real side : {-kAbout, kAbout}) {
      Point about = p;
      about[axis] += side;
      const Point normal = normal_of(objects, k, about);
      least =
          std::min(least, out_of(objects, k, p, normal) + out_of(objects, k, p, times(-1, normal)));
    }
  }
  return least;
}

/// Larger of the two extents perpendicular to the longest one; zero for a sphere, which is as wide
/// as it is thick.
Real width_of(const Objects& objects, std::size_t k) {
  const Obstacle& object = objects.scene->obstacles[k];
  if (const auto* rod = std::get_if<Cylinder>(&object)) return 2 * Real(rod->radius_m);
  if (const auto* box = std::get_if<Box>(&object)) {
    const Eigen::Vector3d& s = box->size_m;
    return std::max(std::min(s[0], s[1]), std::min(std::max(s[0], s[1]), s[2]));
  }
  return objects.mesh_extents[k][1];
}

Point middle_of(const Objects& objects, std::size_t k) {
  const Obstacle& object = objects.scene->obstacles[k];
  if (const auto* ball = std::get_if<Sphere>(&object)) return point_of(ball->centre_in_world);
  if (const auto* box = std::get_if<Box>(&object))
    return point_of(box->world_from_box.translation_m);
  if (const auto* rod = std::get_if<Cylinder>(&object))
    return point_of(rod->world_from_cylinder.translation_m);
  return objects.mesh_middle[k];
}

/// True if the object fills the vertical line from its middle to the table on which it stands.
bool stands(const Objects& objects, std::size_t k, const Point& middle) {
  constexpr Real kStands_m = 0.5e-3L;  // largest gap below it: thinner than cloth
  constexpr int kPlaces = 16;
  const Real table = objects.scene->table_z_m;
  for (int i = 0; i <= kPlaces; ++i) {
    const Real z = middle[2] + (table - middle[2]) * i / kPlaces;
    if (gap_of(objects, k, {middle[0], middle[1], z}) > kStands_m) return false;
  }
  return middle[2] > table;
}

/// True if a piece intersects the vertical line from an object's middle to the table on which it
/// stands: its depth in the object is zero, but cloth can only get there through the object.
bool lies_under(const Objects& objects, std::size_t k, const std::array<Point, 3>& piece) {
  const Point p = middle_of(objects, k);
  const Point u = minus(piece[1], piece[0]), v = minus(piece[2], piece[0]);
  const Point w = minus(p, piece[0]);
  const Real area = u[0] * v[1] - u[1] * v[0];
  if (area == 0) return false;
  const Real s = (w[0] * v[1] - w[1] * v[0]) / area, t = (u[0] * w[1] - u[1] * w[0]) / area;
  if (!(s >= 0 && t >= 0 && s + t <= 1)) return false;
  return piece[0][2] + s * u[2] + t * v[2] < p[2] && stands(objects, k, p);
}

}  // namespace

Real through_of(const Objects& objects, const std::array<Point, 3>& piece) {
  const Point u = minus(piece[1], piece[0]), v = minus(piece[2], piece[0]);
  const Real reach = std::sqrt(std::max(dot(u, u), dot(v, v)));
  Real most = 0;
  for (std::size_t k = 0; k < objects.count(); ++k) {
    if (std::holds_alternative<Plane>(objects.scene->obstacles[k])) continue;
    if (lies_under(objects, k, piece)) return 1;
    if (gap_of(objects, k, piece[0]) > reach) continue;
    // At the rim of a wider object, less than a cell of the cloth may be inside.
    if (width_of(objects, k) > reach) continue;
    const auto place = [&](Real s, Real t) { return plus(plus(piece[0], u, s * (1 - t)), v, t); };
    const auto over = [&](Real t) {
      return least_of([&](Real s) { return gap_of(objects, k, place(s, t)); });
    };
    const auto [gap, t] = least_of([&](Real at) { return over(at).first; });
    if (!(gap < 0)) continue;
    const Real thickness = objects.meshes[k] != nullptr
                               ? objects.mesh_extents[k][0]
                               : thickness_at(objects, k, place(over(t).second, t));
    most = std::max(most, -gap / thickness);
  }
  return most;
}

}  // namespace drape::simulate::checker
