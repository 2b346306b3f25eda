// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/mesh_contact.hpp"

#include <algorithm>
#include <cmath>

namespace drape::simulate::checker {
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

}  // namespace drape::simulate::checker
