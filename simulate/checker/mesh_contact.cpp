// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/mesh_contact.hpp"

#include <algorithm>
#include <cmath>

namespace drape::simulate::checker {
namespace {

Real depth_of(const Objects& objects, const Point& p) {
  Real deepest = 0;
  for (std::size_t k = 0; k <= objects.scene->obstacles.size(); ++k)
    deepest = std::max(deepest, -gap_of(objects, k, p));
  return deepest;
}

}  // namespace

Point left_by(const Objects& objects, const Point& point, Point force) {
  std::size_t nearest = 0;
  Real least = kTouch_m;
  bool touches = false;
  for (std::size_t k = 0; k <= objects.scene->obstacles.size(); ++k) {
    const Real gap = gap_of(objects, k, point);
    if (gap > least) continue;
    least = gap;
    nearest = k;
    touches = true;
  }
  if (!touches) return force;
  const Point normal = normal_of(objects, nearest, point);
  const Real push = -dot(force, normal);
  if (push <= 0) return force;
  for (int axis = 0; axis < 3; ++axis) force[axis] += push * normal[axis];
  const Real along = std::sqrt(dot(force, force)), bears = Real(objects.scene->friction) * push;
  for (Real& f : force) f *= along > bears ? 1 - bears / along : 0;
  return force;
}

MeshDepths depths_of(const Objects& objects, const MeshRest& rest) {
  MeshDepths found;
  for (std::size_t i = 0; i < rest.points_m.size(); ++i)
    found.of_points = std::max(found.of_points, depth_of(objects, point_of(rest.points_m[i])));
  for (const auto& [from, to] : rest.sides) {
    const Point a = point_of(rest.points_m[from]), d = minus(point_of(rest.points_m[to]), a);
    for (const Real part : {0.25L, 0.5L, 0.75L})
      found.between =
          std::max(found.between,
                   depth_of(objects, {a[0] + part * d[0], a[1] + part * d[1], a[2] + part * d[2]}));
  }
  for (const auto& t : rest.triangles) {
    const Point a = point_of(rest.points_m[t[0]]), b = point_of(rest.points_m[t[1]]),
                c = point_of(rest.points_m[t[2]]);
    Point middle;
    for (int axis = 0; axis < 3; ++axis) middle[axis] = (a[axis] + b[axis] + c[axis]) / 3;
    found.between = std::max(found.between, depth_of(objects, middle));
  }
  return found;
}

}  // namespace drape::simulate::checker
