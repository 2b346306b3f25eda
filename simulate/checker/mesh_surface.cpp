// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/mesh_surface.hpp"

#include <algorithm>
#include <cmath>

#include "simulate/checker/mesh_membrane.hpp"

namespace drape::simulate::checker {
namespace {

constexpr Real kOfWeights = 1e-12L;  // what stated weights may miss one by

Point mean(std::initializer_list<Point> places) {
  Point sum{};
  for (const Point& p : places)
    for (int axis = 0; axis < 3; ++axis) sum[axis] += p[axis] / static_cast<Real>(places.size());
  return sum;
}

Real depth_of(const Objects& objects, const Point& p) {
  Real deepest = 0;
  for (std::size_t k = 0; k <= objects.scene->obstacles.size(); ++k)
    deepest = std::max(deepest, -gap_of(objects, k, p));
  return deepest;
}

}  // namespace

MeshSurface::MeshSurface(const MeshRest& rest, const std::vector<Quadratic>& quadratics)
    : rest_(rest), middles_(rest.sides.size()) {
  std::vector<int> beside(rest.sides.size(), 0);
  for (std::size_t t = 0; t < quadratics.size(); ++t) {
    const Quadratic& q = quadratics[t];
    sides_of_.push_back({q.unknown[3], q.unknown[4], q.unknown[5]});
    triangle_at_[rest.triangles[t]] = static_cast<int>(t);
    for (int k = 3; k < 6; ++k) ++beside[q.unknown[k]];
  }
  for (std::size_t s = 0; s < middles_.size(); ++s)
    for (const int end : rest.sides[s]) middles_[s].points[end] += 0.5L;
  // A chord's middle is off its arc by an eighth of the second difference.
  for (const Quadratic& q : quadratics)
    for (int k = 3; k < 6; ++k) {
      const int side = q.unknown[k];
      const auto d = between(rest, rest.sides[side][0], rest.sides[side][1]);
      for (int c = 0; c < 6; ++c) {
        const Real second =
            d[0] * d[0] * q.uu[c] + 2 * d[0] * d[1] * q.uv[c] + d[1] * d[1] * q.vv[c];
        auto& weights = c < 3 ? middles_[side].points : middles_[side].sides;
        weights[q.unknown[c]] -= second / (8 * static_cast<Real>(beside[side]));
      }
    }
}

Point MeshSurface::place_of(const Mixture& of) const {
  Point sum{};
  const auto add = [&](const std::map<int, Real>& weights, const auto& places) {
    for (const auto& [i, weight] : weights) {
      const Point p = point_of(places[i]);
      for (int axis = 0; axis < 3; ++axis) sum[axis] += weight * p[axis];
    }
  };
  add(of.points, rest_.points_m);
  add(of.sides, rest_.of_sides);
  return sum;
}

MeshDepths MeshSurface::depths(const Objects& objects) const {
  MeshDepths found;
  std::vector<Point> middle;
  for (const Mixture& of : middles_) middle.push_back(place_of(of));
  const auto look = [&](const Point& p) {
    found.between = std::max(found.between, depth_of(objects, p));
  };
  for (const Eigen::Vector3d& p : rest_.points_m)
    found.of_points = std::max(found.of_points, depth_of(objects, point_of(p)));
  for (std::size_t s = 0; s < middle.size(); ++s) {
    look(middle[s]);
    for (const int end : rest_.sides[s]) look(mean({point_of(rest_.points_m[end]), middle[s]}));
  }
  for (std::size_t t = 0; t < sides_of_.size(); ++t) {
    const std::array<int, 3>& side = sides_of_[t];
    const Point m[3] = {middle[side[0]], middle[side[1]], middle[side[2]]};
    look(mean({m[0], m[1], m[2]}));
    for (int k = 0; k < 3; ++k) {
      const Point corner = point_of(rest_.points_m[rest_.triangles[t][k]]);
      look(mean({corner, m[(k + 1) % 3], m[(k + 2) % 3]}));
      look(mean({m[(k + 1) % 3], m[(k + 2) % 3]}));
    }
  }
  for (std::size_t t = 0; t < sides_of_.size(); ++t) {
    const std::array<int, 3>& side = sides_of_[t];
    const std::array<Point, 3> m = {middle[side[0]], middle[side[1]], middle[side[2]]};
    found.through = std::max(found.through, through_of(objects, m));
    for (int k = 0; k < 3; ++k) {
      const Point corner = point_of(rest_.points_m[rest_.triangles[t][k]]);
      found.through =
          std::max(found.through, through_of(objects, {corner, m[(k + 1) % 3], m[(k + 2) % 3]}));
    }
  }
  return found;
}

bool MeshSurface::add(const Objects& objects, const ContactForce& stated,
                      std::vector<Point>& on_points, std::vector<Point>& on_sides) const {
  Mixture of;
  if (stated.shape < 0 || static_cast<std::size_t>(stated.shape) > objects.scene->obstacles.size())
    return false;
  const auto known =
      triangle_at_.find({stated.particle[0], stated.particle[1], stated.particle[2]});
  Real total = 0;
  for (const double weight : stated.weight) {
    if (!(weight >= 0)) return false;
    total += weight;
  }
  if (std::abs(total - 1) > kOfWeights || stated.weight[3] != 0) return false;
  if (known == triangle_at_.end()) {
    // A point alone.
    const int i = stated.particle[0];
    if (stated.weight[0] != 1 || i < 0 || static_cast<std::size_t>(i) >= on_points.size())
      return false;
    of.points[i] = 1;
  } else {
    // A corner's facet where its weight is a half or more, else the one in the middle.
    std::array<Real, 3> corner{}, side{};
    int facet = 3;
    for (int k = 0; k < 3; ++k)
      if (stated.weight[k] >= 0.5) facet = k;
    for (int k = 0; k < 3; ++k) {
      const Real weight = stated.weight[k];
      if (facet == 3)
        side[k] = 1 - 2 * weight;
      else if (k == facet)
        corner[k] = 2 * weight - 1;
      else
        side[3 - facet - k] = 2 * weight;  // half of it lies in the middle opposite the third
    }
    for (int k = 0; k < 3; ++k) {
      of.points[rest_.triangles[known->second][k]] += corner[k];
      const Mixture& middle = middles_[sides_of_[known->second][k]];
      for (const auto& [i, weight] : middle.points) of.points[i] += side[k] * weight;
      for (const auto& [i, weight] : middle.sides) of.sides[i] += side[k] * weight;
    }
  }
  const auto force = pushed_by(objects, static_cast<std::size_t>(stated.shape), place_of(of),
                               Real(objects.scene->friction), kTouch_m, stated.force_in_world);
  if (!force) return false;
  for (int axis = 0; axis < 3; ++axis) {
    for (const auto& [i, weight] : of.points) on_points[i][axis] += weight * (*force)[axis];
    for (const auto& [i, weight] : of.sides) on_sides[i][axis] += weight * (*force)[axis];
  }
  return true;
}

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
