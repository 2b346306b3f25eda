// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/surface.hpp"

#include <Eigen/Eigenvalues>
#include <limits>
#include <variant>

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

/// True for the table and for planes.
bool is_flat(const Objects& objects, std::size_t k) {
  return k == objects.count() || std::holds_alternative<Plane>(objects.scene->obstacles[k]);
}

/// Distance from the table, or from an object whose thin gaps with table and planes are closed: the
/// cross-section above such a gap reaches down.
Real gap_over_floors(const Objects& objects, std::size_t k, const Point& p) {
  const Point up = {0, 0, 1};
  if (k == objects.count()) return p[2] - Real(objects.scene->table_z_m);
  const auto own = [&](const Point& at) {
    return std::visit(Gap{objects, k, at}, objects.scene->obstacles[k]);
  };
  const Real gap = own(p);
  if (is_flat(objects, k)) return gap;
  Real least = gap;
  for (std::size_t floor = 0; floor <= objects.count(); ++floor) {
    if (!is_flat(objects, floor)) continue;
    const Real over = gap_over_floors(objects, floor, p);
    const Point normal =
        floor == objects.count()
            ? up
            : point_of(std::get<Plane>(objects.scene->obstacles[floor]).normal_in_world);
    if (over < kClosed_m) least = std::min(least, own(plus(p, normal, kClosed_m - over)));
  }
  return least;
}

/// True if the object has edges with a radius below the depth of pressed contact points.
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

/// Normals of faces and edges near a point; empty for an object without edges.
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

/// Distance from a point inside a convex object to its surface along a direction.
Real out_of(const Objects& objects, std::size_t k, const Point& p, const Point& direction) {
  Real inside = 0, outside = 1e-5L;
  while (gap_of(objects, k, plus(p, direction, outside)) < 0) outside *= 2;
  for (int halving = 0; halving < 40; ++halving) {
    const Real middle = (inside + outside) / 2;
    (gap_of(objects, k, plus(p, direction, middle)) < 0 ? inside : outside) = middle;
  }
  return outside;
}

/// Thickness of a convex object near a point inside it. Uses nearby points, because the normal is
/// undefined in the middle of an object.
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

constexpr Real kOfWeights = 1e-12L;  // deviation of the sum of stated weights from one
// Relative to the distance on the flat piece: layers closer than this repel.
constexpr Real kOfFlat = 0.25L;
// Slope of the distance along a piece at its minimum.
constexpr Real kNearestAllowed = 1e-6L;
// Two pins on a round body hold the cloth between them inside it. A facet with a pin this close to
// the object may therefore be deeper, by this fraction of its longest edge.
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

/// True if a piece intersects the straight line from an object's middle to the table, a plane or
/// the middle of another object on which it stands, where no gap along the line is open. Its depth
/// is zero where they touch, but cloth gets there only through one of them.
bool lies_between(const Objects& objects, std::size_t k, const std::array<Point, 3>& piece) {
  constexpr int kPlaces = 16;
  const Point from = middle_of(objects, k);
  for (std::size_t other = 0; other <= objects.count(); ++other) {
    if (other == k) continue;
    Point to;
    if (is_flat(objects, other)) {
      const Real over = gap_of(objects, other, from);
      if (!(over > 0)) continue;
      to = plus(from, normal_of(objects, other, from), -over - kClosed_m);
    } else {
      to = middle_of(objects, other);
    }
    if (!passes({from, to, piece[0], piece[1], piece[2]}, {0, 1}, {2, 3, 4})) continue;
    bool open = false;
    for (int i = 0; i <= kPlaces; ++i) {
      const Point p = plus(from, minus(to, from), static_cast<Real>(i) / kPlaces);
      open |= std::min(gap_of(objects, k, p), gap_of(objects, other, p)) > kClosed_m;
    }
    if (!open) return true;
  }
  return false;
}

/// True if the weights before and after `firsts`, negative for the second piece, each describe a
/// point on one piece.
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
  const Real gap = gap_over_floors(objects, k, p);
  if (is_flat(objects, k)) return gap;
  Real least = gap;
  for (std::size_t other = 0; other < objects.count(); ++other) {
    if (other == k || is_flat(objects, other)) continue;
    const Real sum = gap + gap_over_floors(objects, other, p) - Real(kClosed_m);
    least = std::min(least, sum > 0 ? sum / 2 : sum);
  }
  return least;
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

Real through_of(const Objects& objects, const std::array<Point, 3>& piece) {
  const Point u = minus(piece[1], piece[0]), v = minus(piece[2], piece[0]);
  const Real reach = std::sqrt(std::max(dot(u, u), dot(v, v)));
  Real most = 0;
  for (std::size_t k = 0; k < objects.count(); ++k) {
    if (std::holds_alternative<Plane>(objects.scene->obstacles[k])) continue;
    if (lies_between(objects, k, piece)) return 1;
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
    // A zero weight leaves open whether the pieces are a node and a facet or two edges.
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
