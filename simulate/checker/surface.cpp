// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace drape::simulate::checker {
namespace {

constexpr Real kOfWeights = 1e-12L;  // deviation of the sum of stated weights from one
// Relative to the distance on the flat piece: layers closer than this repel.
constexpr Real kOfFlat = 0.25L;
// Slope of the distance along a piece at its minimum.
constexpr Real kNearestAllowed = 1e-6L;
// Two pins on a round body hold the cloth between them inside it: beyond this distance from a pin,
// by this fraction of a facet's longest side.
constexpr Real kNearPin_m = 0.2e-3L, kOfFacetByPin = 0.1L;
constexpr Real kBeside =
    1e-6L;  // fraction of a triangle: material points this far outside count as on it

template <class Nodes>
Range range_of(const std::vector<Point>& places, const Nodes& nodes) {
  Range range(places[nodes[0]]);
  for (const int node : nodes) range.take(places[node]);
  return range;
}

/// Largest extent of a facet's bounding box along an axis.
Real size_of(const std::vector<Point>& places, const std::vector<std::array<int, 3>>& facets) {
  Real size = 0;
  for (const auto& facet : facets) {
    const Range range = range_of(places, facet);
    for (int axis = 0; axis < 3; ++axis)
      size = std::max(size, Real(range.high[axis] - range.low[axis]));
  }
  return size;
}

bool passes(const std::vector<Point>& places, const std::array<int, 2>& edge,
            const std::array<int, 3>& facet) {
  const Point &from = places[edge[0]], &o = places[facet[0]];
  const Point span = minus(places[edge[1]], from), w = minus(from, o);
  const Point u = minus(places[facet[1]], o), v = minus(places[facet[2]], o);
  const Point normal = cross(u, v);
  const Real speed = dot(normal, span);
  if (speed == 0) return false;
  const Real at = -dot(normal, w) / speed;
  if (at < 0 || at > 1) return false;
  const Point p = plus(w, span, at);
  const Real area2 = dot(normal, normal);
  const Real s = dot(cross(p, v), normal) / area2;
  const Real r = dot(cross(u, p), normal) / area2;
  return s >= 0 && r >= 0 && s + r <= 1;
}

/// True if the weights before and after `firsts`, negative for the second piece, each describe a
/// place on one piece.
bool are_weights(const std::array<double, 4>& weight, int firsts) {
  std::array<Real, 2> sum{};
  for (int k = 0; k < 4; ++k) {
    const Real of = k < firsts ? weight[k] : -weight[k];
    if (!(of >= 0)) return false;
    sum[k < firsts ? 0 : 1] += of;
  }
  return std::abs(sum[0] - 1) <= kOfWeights && (firsts == 4 || std::abs(sum[1] - 1) <= kOfWeights);
}

}  // namespace

Range::Range(const Point& p) {
  low.fill(std::numeric_limits<float>::infinity());
  high.fill(-std::numeric_limits<float>::infinity());
  take(p);
}

void Range::take(const Point& p) {
  constexpr float kFar = std::numeric_limits<float>::max();
  for (int axis = 0; axis < 3; ++axis) {
    const auto x = static_cast<float>(p[axis]);
    low[axis] = std::min(low[axis], std::nextafter(x, -kFar));
    high[axis] = std::max(high[axis], std::nextafter(x, kFar));
  }
}

void Lattice::insert(const Range& range) {
  visit_cells(range.low, range.high,
              [&](std::uint64_t cell) { items_[cell].emplace_back(range, count_); });
  ++count_;
}

MeshSurface::MeshSurface(const MeshRest& rest, const std::vector<Quadratic>& quadratics)
    : rest_(rest), middles_(rest.shape.sides.size()) {
  const ClothShape& shape = rest.shape;
  const auto points = static_cast<int>(shape.points_m.size());
  for (int i = 0; i < points; ++i) {
    nodes_.push_back(point_of(shape.points_m[i]));
    flat_.push_back({shape.material_m[i].x(), shape.material_m[i].y(), 0});
  }
  std::vector<int> beside(shape.sides.size(), 0);
  for (const Quadratic& q : quadratics)
    for (int k = 3; k < 6; ++k) ++beside[q.unknown[k]];
  for (std::size_t s = 0; s < middles_.size(); ++s) {
    const auto [from, to] = shape.sides[s];
    middles_[s].points[from] = middles_[s].points[to] = 0.5L;
    flat_.push_back(times(0.5L, plus(flat_[from], flat_[to])));
  }
  // The midpoint of a chord is off its arc by an eighth of the second difference.
  for (const Quadratic& q : quadratics)
    for (int k = 3; k < 6; ++k) {
      const int side = q.unknown[k];
      const Point d = minus(flat_[shape.sides[side][1]], flat_[shape.sides[side][0]]);
      for (int c = 0; c < 6; ++c) {
        const Real second =
            d[0] * d[0] * q.uu[c] + 2 * d[0] * d[1] * q.uv[c] + d[1] * d[1] * q.vv[c];
        auto& weights = c < 3 ? middles_[side].points : middles_[side].sides;
        weights[q.unknown[c]] -= second / (8 * static_cast<Real>(beside[side]));
      }
    }
  for (const Mixture& of : middles_) {
    Point place{};
    for (const auto& [i, weight] : of.points) place = plus(place, nodes_[i], weight);
    for (const auto& [i, weight] : of.sides)
      place = plus(place, point_of(shape.of_sides[i]), weight);
    nodes_.push_back(place);
  }
  for (const Quadratic& q : quadratics) {
    const int m[3] = {points + q.unknown[3], points + q.unknown[4], points + q.unknown[5]};
    facets_.push_back({m[0], m[1], m[2]});
    for (int k = 0; k < 3; ++k) facets_.push_back({q.unknown[k], m[(k + 2) % 3], m[(k + 1) % 3]});
  }
  sorted_ = facets_;
  for (Nodes& facet : sorted_) {
    std::sort(facet.begin(), facet.end());
    edges_.push_back({facet[0], facet[1]});
    edges_.push_back({facet[0], facet[2]});
    edges_.push_back({facet[1], facet[2]});
  }
  std::sort(sorted_.begin(), sorted_.end());
  std::sort(edges_.begin(), edges_.end());
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
}

MeshDepths MeshSurface::depths(const Objects& objects, const std::vector<bool>& held) const {
  MeshDepths found;
  for (std::size_t k = 0; k <= objects.count(); ++k) {
    const Real allowed = allowed_between_m(objects, k);
    std::vector<Real> gap;
    for (const Point& node : nodes_) gap.push_back(gap_of(objects, k, node));
    const Real least = *std::min_element(gap.begin(), gap.end());
    if (k == objects.count())
      found.to_table = least;
    else
      found.to_object = std::min(found.to_object.value_or(least), least);
    found.deepest = std::max(found.deepest, -least);
    for (const Nodes& facet : facets_) {
      const Point& o = nodes_[facet[0]];
      const Point u = minus(nodes_[facet[1]], o), v = minus(nodes_[facet[2]], o);
      const Real longest = std::max({length(u), length(v), length(minus(u, v))});
      // A distance changes at most by the length of the path.
      if (gap[facet[0]] > longest) continue;
      const int steps = static_cast<int>(std::ceil(longest / kLook_m));
      Real deepest = 0;
      for (int s = 0; s <= steps; ++s)
        for (int t = 0; s + t <= steps; ++t)
          deepest = std::max(deepest, -gap_of(objects, k,
                                              plus(plus(o, u, static_cast<Real>(s) / steps), v,
                                                   static_cast<Real>(t) / steps)));
      const bool by_pin = std::any_of(facet.begin(), facet.end(), [&](int node) {
        return static_cast<std::size_t>(node) < held.size() && held[node] && gap[node] < kNearPin_m;
      });
      found.deepest = std::max(found.deepest, deepest);
      found.over = std::max(
          found.over, deepest - (by_pin ? std::max(allowed, kOfFacetByPin * longest) : allowed));
    }
  }
  for (const Nodes& facet : facets_)
    found.through = std::max(
        found.through, through_of(objects, {nodes_[facet[0]], nodes_[facet[1]], nodes_[facet[2]]}));
  return found;
}

bool MeshSurface::is_piece(std::vector<int> nodes) const {
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  if (nodes.size() == 3)
    return std::binary_search(sorted_.begin(), sorted_.end(), Nodes{nodes[0], nodes[1], nodes[2]});
  if (nodes.size() == 2)
    return std::binary_search(edges_.begin(), edges_.end(), std::array<int, 2>{nodes[0], nodes[1]});
  return nodes.size() == 1;
}

std::optional<Point> MeshSurface::object_force(const Objects& objects, const ContactForce& stated) {
  std::vector<int> nodes;
  Point place{};
  for (int k = 0; k < 4; ++k) {
    if (stated.weight[k] == 0) continue;
    nodes.push_back(stated.particle[k]);
    place = plus(place, nodes_[stated.particle[k]], stated.weight[k]);
  }
  if (!are_weights(stated.weight, 4) || !is_piece(nodes)) return std::nullopt;
  const auto k = static_cast<std::size_t>(stated.shape);
  deepest_pressed_ = std::max(deepest_pressed_, -gap_of(objects, k, place));
  return pushed_by(objects, k, place, Real(objects.scene->friction), stated.force_in_world);
}

/// The first `firsts` nodes belong to the first piece, the others to the second.
std::optional<Point> MeshSurface::layer_force(const ContactForce& stated, int firsts,
                                              Real friction) {
  const std::array<int, 4>& node = stated.particle;
  for (int k = 0; k < firsts; ++k)
    for (int l = firsts; l < 4; ++l)
      if (node[k] == node[l]) return std::nullopt;
  const bool pieces = firsts == 1 ? is_piece({node[1], node[2], node[3]})
                                  : is_piece({node[0], node[1]}) && is_piece({node[2], node[3]});
  if (!pieces || !are_weights(stated.weight, firsts)) return std::nullopt;
  Point apart{}, on_flat{};
  std::array<Point, 2> place{};  // on the first and on the second piece
  for (int k = 0; k < 4; ++k) {
    const Real weight = stated.weight[k];
    apart = plus(apart, nodes_[node[k]], weight);
    on_flat = plus(on_flat, flat_[node[k]], weight);
    Point& own = place[k < firsts ? 0 : 1];
    own = plus(own, nodes_[node[k]], std::abs(weight));
  }
  const Real distance = length(apart);
  const Real near_m = std::min(Real(rest_.layers_apart_m), kOfFlat * length(on_flat)) + kRounding_m;
  if (!(distance > 0) || distance > near_m) return std::nullopt;
  for (int k = 0; k < 4; ++k) {
    const bool first = k < firsts;
    const Point along = minus(nodes_[node[k]], place[first ? 0 : 1]);
    if ((first ? 1 : -1) * dot(along, apart) < -kNearestAllowed * distance * length(along))
      return std::nullopt;
  }
  nearest_layers_ = std::min(nearest_layers_.value_or(distance), distance);
  return within_cone(point_of(stated.force_in_world), times(1 / distance, apart), friction);
}

bool MeshSurface::add(const Objects& objects, const ContactForce& stated,
                      std::vector<Point>& on_points, std::vector<Point>& on_sides) {
  const auto itself = static_cast<int>(objects.count()) + 1;
  if (stated.shape < 0 || stated.shape > itself) return false;
  for (const int i : stated.particle)
    if (i < 0 || static_cast<std::size_t>(i) >= nodes_.size()) return false;
  std::optional<Point> force;
  if (stated.shape < itself) {
    force = object_force(objects, stated);
  } else {
    // A weight of 0 leaves open if the pieces are a node and a facet or two edges.
    for (const int firsts : {1, 2})
      if (!force) force = layer_force(stated, firsts, Real(objects.scene->friction));
  }
  if (!force) return false;
  for (int k = 0; k < 4; ++k) {
    const auto side = stated.particle[k] - static_cast<int>(rest_.shape.points_m.size());
    const auto add_to = [&](Point& sum, Real weight) {
      sum = plus(sum, *force, stated.weight[k] * weight);
    };
    if (side < 0) {
      add_to(on_points[stated.particle[k]], 1);
      continue;
    }
    for (const auto& [i, weight] : middles_[side].points) add_to(on_points[i], weight);
    for (const auto& [i, weight] : middles_[side].sides) add_to(on_sides[i], weight);
  }
  return true;
}

int MeshSurface::crossings() const {
  const Real size = size_of(nodes_, facets_);
  if (!(size > 0)) return 0;
  Lattice lattice(size);
  for (const Nodes& facet : facets_) lattice.insert(range_of(nodes_, facet));
  int crossings = 0;
  for (const std::array<int, 2>& edge : edges_)
    lattice.visit_meeting(range_of(nodes_, edge), [&](int f) {
      bool joined = false;
      for (const int node : facets_[f]) joined = joined || node == edge[0] || node == edge[1];
      crossings += !joined && passes(nodes_, edge, facets_[f]) ? 1 : 0;
    });
  return crossings;
}

std::optional<Eigen::Vector3d> MeshSurface::place(const Eigen::Vector2d& material_m) const {
  if (!by_material_) {
    by_material_.emplace(2 * size_of(flat_, facets_));
    for (std::size_t f = 0; f < facets_.size(); f += 4) {
      Range range = range_of(flat_, facets_[f + 1]);
      for (const std::size_t corner : {f + 2, f + 3}) range.take(flat_[facets_[corner][0]]);
      by_material_->insert(range);
    }
  }
  const Point at = {material_m.x(), material_m.y(), 0};
  std::optional<Eigen::Vector3d> found;
  by_material_->visit_meeting(Range(at), [&](int triangle) {
    const Nodes* const facet = &facets_[4 * static_cast<std::size_t>(triangle)];
    const Nodes corner = {facet[1][0], facet[2][0], facet[3][0]};
    const Point u = minus(flat_[corner[1]], flat_[corner[0]]),
                v = minus(flat_[corner[2]], flat_[corner[0]]), w = minus(at, flat_[corner[0]]);
    const Real area = u[0] * v[1] - u[1] * v[0];
    const Real s = (w[0] * v[1] - w[1] * v[0]) / area, t = (u[0] * w[1] - u[1] * w[0]) / area;
    if (found || s < -kBeside || t < -kBeside || s + t > 1 + kBeside) return;
    const Real weight[3] = {1 - s - t, s, t};
    Point p{};
    for (int k = 0; k < 3; ++k) {
      p = plus(p, nodes_[corner[k]], weight[k] * (2 * weight[k] - 1));
      p = plus(p, nodes_[facet[0][k]], 4 * weight[(k + 1) % 3] * weight[(k + 2) % 3]);
    }
    found = Eigen::Vector3d(double(p[0]), double(p[1]), double(p[2]));
  });
  return found;
}

}  // namespace drape::simulate::checker
