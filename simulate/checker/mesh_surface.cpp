// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/mesh_surface.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "simulate/checker/layers.hpp"
#include "simulate/checker/mesh_contact.hpp"
#include "simulate/checker/mesh_membrane.hpp"

namespace drape::simulate::checker {

namespace {

constexpr Real kOfWeights = 1e-12L;  // difference of stated weights from one
constexpr Real kOfFlat = 0.25L;  // relative to the distance on the flat piece: nearer, layers press

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

bool passes(const std::vector<Point>& corners, int from, int to, const Point& span,
            const std::array<int, 3>& c) {
  for (const int i : c)
    if (i == from || i == to) return false;
  const Point o = corners[c[0]];
  const Point u = minus(corners[c[1]], o), v = minus(corners[c[2]], o), w = minus(corners[from], o);
  const Point normal = cross(u, v);
  const Real speed = dot(normal, span);
  if (speed == 0) return false;
  const Real at = -dot(normal, w) / speed;
  if (at < 0 || at > 1) return false;
  const Point p = {w[0] + at * span[0], w[1] + at * span[1], w[2] + at * span[2]};
  const Real area2 = dot(normal, normal);
  const Real s = dot(cross(p, v), normal) / area2;
  const Real r = dot(cross(u, p), normal) / area2;
  return s >= 0 && r >= 0 && s + r <= 1;
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
  for (const Eigen::Vector3d& p : rest.points_m) nodes_.push_back(point_of(p));
  for (const Mixture& of : middles_) nodes_.push_back(place_of(of));
  const auto points = static_cast<int>(rest.points_m.size());
  const auto add = [&](std::array<int, 3> facet) {
    std::sort(facet.begin(), facet.end());
    facets_.push_back(facet);
    edges_.push_back({facet[0], facet[1]});
    edges_.push_back({facet[0], facet[2]});
    edges_.push_back({facet[1], facet[2]});
  };
  for (std::size_t t = 0; t < sides_of_.size(); ++t) {
    std::array<int, 3> middle = sides_of_[t];
    for (int& m : middle) m += points;
    add(middle);
    for (int k = 0; k < 3; ++k)
      add({rest.triangles[t][k], middle[(k + 1) % 3], middle[(k + 2) % 3]});
  }
  std::sort(facets_.begin(), facets_.end());
  std::sort(edges_.begin(), edges_.end());
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
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
  if (stated.shape == static_cast<int>(objects.scene->obstacles.size()) + 1)
    return add_layers(stated, Real(objects.scene->friction), on_points, on_sides);
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

int MeshSurface::crossings() const {
  return crossings_of(nodes_, edges_, facets_);
}

bool MeshSurface::are_pieces(const std::array<int, 4>& node, int firsts) const {
  for (int k = 0; k < firsts; ++k)
    for (int l = firsts; l < 4; ++l)
      if (node[k] == node[l]) return false;
  const auto is_edge = [&](int a, int b) {
    const std::array<int, 2> edge = {std::min(a, b), std::max(a, b)};
    return std::binary_search(edges_.begin(), edges_.end(), edge);
  };
  if (firsts == 2) return is_edge(node[0], node[1]) && is_edge(node[2], node[3]);
  std::array<int, 3> facet = {node[1], node[2], node[3]};
  std::sort(facet.begin(), facet.end());
  return std::binary_search(facets_.begin(), facets_.end(), facet);
}

/// Means of the two places.
Real MeshSurface::apart_on_flat_m(const ContactForce& stated) const {
  const auto points = static_cast<int>(rest_.points_m.size());
  std::array<Real, 2> apart{};
  for (int k = 0; k < 4; ++k) {
    const int i = stated.particle[k];
    for (int axis = 0; axis < 2; ++axis) {
      const auto at = [&](int point) { return Real(rest_.material_m[point][axis]); };
      const Real place =
          i < points ? at(i)
                     : (at(rest_.sides[i - points][0]) + at(rest_.sides[i - points][1])) / 2;
      apart[axis] += stated.weight[k] * place;
    }
  }
  return std::sqrt(apart[0] * apart[0] + apart[1] * apart[1]);
}

bool MeshSurface::add_layers(const ContactForce& stated, Real friction,
                             std::vector<Point>& on_points, std::vector<Point>& on_sides) const {
  std::array<Point, 4> corner{};
  for (int k = 0; k < 4; ++k) {
    const int i = stated.particle[k];
    if (i < 0 || static_cast<std::size_t>(i) >= nodes_.size()) return false;
    corner[k] = nodes_[i];
  }
  const Real near_m = std::min(Real(rest_.layers_apart_m), kOfFlat * apart_on_flat_m(stated));
  // Where a weight is 0, neighbours may be read in both directions.
  std::optional<Point> force;
  for (const int firsts : {1, 2})
    if (!force && are_layer_weights(stated.weight, firsts) && are_pieces(stated.particle, firsts))
      force = layer_force(corner, stated.weight, firsts, friction, near_m + kTouch_m,
                          stated.force_in_world);
  if (!force) return false;
  for (int k = 0; k < 4; ++k) {
    const auto side = stated.particle[k] - static_cast<std::ptrdiff_t>(rest_.points_m.size());
    const auto add = [&](Point& sum, Real weight) {
      for (int axis = 0; axis < 3; ++axis) sum[axis] += stated.weight[k] * weight * (*force)[axis];
    };
    if (side < 0) {
      add(on_points[stated.particle[k]], 1);
      continue;
    }
    for (const auto& [i, weight] : middles_[side].points) add(on_points[i], weight);
    for (const auto& [i, weight] : middles_[side].sides) add(on_sides[i], weight);
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

/// Sides through triangles, by a lattice of boxes as large as the largest triangle.
int crossings_of(const std::vector<Point>& corners, const std::vector<std::array<int, 2>>& sides,
                 const std::vector<std::array<int, 3>>& triangles) {
  int crossings = 0;
  Real size = 0;
  std::vector<std::pair<Point, Point>> bounds;
  for (const auto& t : triangles) {
    Point low = corners[t[0]], high = low;
    for (const int i : {t[1], t[2]})
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], corners[i][axis]);
        high[axis] = std::max(high[axis], corners[i][axis]);
      }
    for (int axis = 0; axis < 3; ++axis) size = std::max(size, high[axis] - low[axis]);
    bounds.emplace_back(low, high);
  }
  if (!(size > 0)) return 0;
  const auto box = [&](Real x) { return static_cast<long>(std::floor(x / size)); };
  std::map<std::array<long, 3>, std::vector<int>> boxes;
  const auto visit = [&](const Point& low, const Point& high, const auto& at) {
    for (long x = box(low[0]); x <= box(high[0]); ++x)
      for (long y = box(low[1]); y <= box(high[1]); ++y)
        for (long z = box(low[2]); z <= box(high[2]); ++z) at(std::array<long, 3>{x, y, z});
  };
  for (std::size_t t = 0; t < bounds.size(); ++t)
    visit(bounds[t].first, bounds[t].second,
          [&](const auto& key) { boxes[key].push_back(static_cast<int>(t)); });
  for (const auto& [from, to] : sides) {
    const Point a = corners[from], b = corners[to];
    Point low = a, high = a;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(a[axis], b[axis]);
      high[axis] = std::max(a[axis], b[axis]);
    }
    std::vector<int> near;
    visit(low, high, [&](const auto& key) {
      if (const auto found = boxes.find(key); found != boxes.end())
        near.insert(near.end(), found->second.begin(), found->second.end());
    });
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    for (const int t : near)
      crossings += passes(corners, from, to, minus(b, a), triangles[t]) ? 1 : 0;
  }
  return crossings;
}

int crossings_of(const MeshRest& rest) {
  std::vector<Point> points;
  for (const Eigen::Vector3d& p : rest.points_m) points.push_back(point_of(p));
  return crossings_of(points, rest.sides, rest.triangles);
}

}  // namespace drape::simulate::checker
