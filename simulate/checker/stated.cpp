// SPDX-License-Identifier: Apache-2.0
// Contact forces that a certificate states, cut down to what contact can do.
#include <algorithm>
#include <cmath>

#include "simulate/checker/scene.hpp"

namespace drape::simulate::checker {
namespace {

// m; solvers round places of objects to 0.12 nm, so the surface may stand this much elsewhere.
constexpr Real kPlaceRounding = 0.2e-9L;
constexpr Real kCut = 1e-12L;  // relative to a force; less taken away asks for no other normal
constexpr Real kStep = 50;     // factor by which the change of the normal is looked at

Real length_of_vector(const Point& v) {
  return std::sqrt(checker::dot(v, v));
}

/// Angle (rad) by which the normal turns when the object moves by its rounding.
Real turn_of_normal(const Objects& objects, std::size_t k, const Point& p, const Point& normal) {
  Real most = 0;
  for (int axis = 0; axis < 3; ++axis) {
    Point beside = p;
    beside[axis] += kStep * kPlaceRounding;
    most = std::max(most, length_of_vector(checker::minus(normal_of(objects, k, beside), normal)));
  }
  return most / kStep;
}

/// Part of a force that is no pull and within the cone of friction about a normal.
Point within_cone(const Point& force, const Point& normal, Real friction) {
  const Real pressing = std::max<Real>(0, checker::dot(force, normal));
  Point along{}, kept{};
  for (int axis = 0; axis < 3; ++axis) along[axis] = force[axis] - pressing * normal[axis];
  const Real part =
      std::min<Real>(1, friction * pressing / std::max<Real>(length_of_vector(along), 1e-300L));
  for (int axis = 0; axis < 3; ++axis) kept[axis] = pressing * normal[axis] + part * along[axis];
  return kept;
}

/// True if the object is one of the scene and the place one of the sheet: within a single cell.
bool is_of(const ContactForce& stated, std::size_t objects, std::size_t particles, int cols) {
  if (static_cast<std::size_t>(stated.shape) > objects) return false;
  for (const int i : stated.particle) {
    if (static_cast<std::size_t>(i) >= particles) return false;
    for (const int j : stated.particle) {
      if (std::abs(i / cols - j / cols) > 1 || std::abs(i % cols - j % cols) > 1) return false;
    }
  }
  return true;
}

}  // namespace

std::optional<Point> pushed_by(const Objects& objects, std::size_t k, const Point& p, Real friction,
                               Real touch_m, const Eigen::Vector3d& stated_n) {
  if (gap_of(objects, k, p) > touch_m) return std::nullopt;
  Point force{};
  for (int axis = 0; axis < 3; ++axis) force[axis] = stated_n[axis];
  const Point normal = normal_of(objects, k, p);
  Point kept = within_cone(force, normal, friction + turn_of_normal(objects, k, p, normal));
  Real least = length_of_vector(checker::minus(force, kept));
  if (least <= kCut * length_of_vector(force)) return kept;
  for (const Point& other : sharp_normals_of(objects, k, p)) {
    const Point cut = within_cone(force, other, friction);
    const Real lost = length_of_vector(checker::minus(force, cut));
    if (lost >= least) continue;
    least = lost;
    kept = cut;
  }
  return kept;
}

bool add_stated(const Objects& objects, const std::vector<Point>& points, int cols, Real friction,
                Real touch_m, const ContactForce& stated, std::vector<Point>& sum) {
  if (!is_of(stated, objects.scene->obstacles.size(), points.size(), cols)) return false;
  Point p{};
  Real weights = 0;
  for (int c = 0; c < 4; ++c) {
    const Real weight = stated.weight[c];
    if (weight < 0) return false;
    weights += weight;
    for (int axis = 0; axis < 3; ++axis) p[axis] += weight * points[stated.particle[c]][axis];
  }
  if (std::abs(weights - 1) > 1e-12L) return false;
  const auto force = pushed_by(objects, static_cast<std::size_t>(stated.shape), p, friction,
                               touch_m, stated.force_in_world);
  if (!force) return false;
  for (int c = 0; c < 4; ++c)
    for (int axis = 0; axis < 3; ++axis)
      sum[stated.particle[c]][axis] += Real(stated.weight[c]) * (*force)[axis];
  return true;
}

}  // namespace drape::simulate::checker
