// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/scene.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/objects/surroundings.hpp"

/// Independent geometry of the checker: vectors in long double, distances to the objects of a
/// scene, and the surface of a cloth mesh between its points with the forces on it.
namespace drape::simulate::checker {

using Real = long double;
using Point = std::array<Real, 3>;

[[nodiscard]] inline Point point_of(const Eigen::Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}
/// a + factor b
[[nodiscard]] inline Point plus(const Point& a, const Point& b, Real factor = 1) {
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}
[[nodiscard]] inline Point minus(const Point& a, const Point& b) {
  return plus(a, b, -1);
}
[[nodiscard]] inline Point times(Real factor, const Point& a) {
  return {factor * a[0], factor * a[1], factor * a[2]};
}
[[nodiscard]] inline Real dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline Real length(const Point& a) {
  return std::sqrt(dot(a, a));
}

constexpr Real kTouch_m = 0.02e-3L;  ///< distance below which an object can press
constexpr Real kSunk_m = 0.05e-3L;   ///< largest depth of a pressed contact point
constexpr Real kLook_m = 0.5e-3L;    ///< step size for sampling a surface
/// Largest distance from the cloth to a possible contact point: these lie on triangles of 0.75
/// mm.
constexpr Real kFarthest_m = 0.45e-3L;
constexpr Real kRounding_m = 1e-9L;  ///< rounding of positions in files and local frames

struct Objects {
  explicit Objects(const Scene& objects_of);

  [[nodiscard]] std::size_t count() const { return scene->obstacles.size(); }

  const Scene* scene;
  std::vector<std::shared_ptr<Surroundings>> meshes;  ///< one per mesh object, else null
  std::vector<Point> mesh_extents;  ///< extents of each mesh along principal axes, smallest first
  std::vector<Point> mesh_middle;   ///< mean of each mesh's corners
};

/// Signed distance from object `k`, or from the table if k is the number of obstacles.
[[nodiscard]] Real gap_of(const Objects& objects, std::size_t k, const Point& p);
/// Gradient of the distance, by central differences.
[[nodiscard]] Point normal_of(const Objects& objects, std::size_t k, const Point& p);

/// Largest penetration of a flat facet between contact points that are kSunk_m deep: the sagitta of
/// its half-span over the tightest radius of the object; over a sharp edge, that half-span.
[[nodiscard]] Real allowed_between_m(const Objects& objects, std::size_t k);

/// Fraction of an object's thickness beyond which the cloth passes through its middle.
constexpr Real kThrough = 0.25L;
/// Depth of a flat piece of cloth in an object, as a fraction of the object's thickness there. The
/// thickness is the shortest chord through the deepest point along nearby normals; for a mesh, its
/// smallest extent. Maximum over the objects narrower than the piece, 0 for none; 1 between the
/// middles of two objects that touch, or an object's middle and the table or plane that it touches.
[[nodiscard]] Real through_of(const Objects& objects, const std::array<Point, 3>& piece);

/// Projects a force into the friction cone about a normal; zero for a force that pulls.
[[nodiscard]] Point within_cone(const Point& force, const Point& normal, Real friction);
/// Part of a stated contact force (N) that object `k` can exert at a point: within the friction
/// cone about the normal, which may turn by the rounding of the object's position. At an edge, the
/// cone about the adjacent face normal that removes least. nullopt if the point is farther than
/// kTouch_m outside.
[[nodiscard]] std::optional<Point> pushed_by(const Objects& objects, std::size_t k, const Point& p,
                                             Real friction, const Eigen::Vector3d& stated_n);

/// A quadratic over a triangle: area, unknowns (corners, edges) and their weights in its second
/// derivatives.
struct Quadratic {
  Real area;
  std::array<int, 6> unknown;
  std::vector<Real> uu, uv, vv;
};

/// Bounding box of points in floats, rounded outwards, for fast comparison of many boxes.
struct Range {
  std::array<float, 3> low, high;

  explicit Range(const Point& p);
  void take(const Point& p);
  [[nodiscard]] bool meets(const Range& other) const {
    bool apart = false;
    for (int axis = 0; axis < 3; ++axis)
      apart |= low[axis] > other.high[axis] || high[axis] < other.low[axis];
    return !apart;
  }
};

/// Boxes indexed by the cells of a grid that they overlap.
class Lattice {
 public:
  explicit Lattice(Real size) : per_m_(static_cast<float>(1 / size)) {}
  void insert(const Range& range);
  /// Calls visit(i) once for each inserted box, number i, that overlaps the given one.
  template <class Visit>
  void visit_meeting(const Range& range, Visit visit) const {
    visit_cells(range.low, range.high, [&](std::uint64_t cell) {
      const auto at = items_.find(cell);
      if (at == items_.end()) return;
      for (const auto& [other, item] : at->second) {
        if (!other.meets(range)) continue;
        std::array<float, 3> first;  // lowest corner of the intersection: its cell reports the pair
        for (int axis = 0; axis < 3; ++axis)
          first[axis] = std::max(range.low[axis], other.low[axis]);
        visit_cells(first, first, [&, i = item](std::uint64_t home) {
          if (home == cell) visit(i);
        });
      }
    });
  }

 private:
  template <class Visit>
  void visit_cells(const std::array<float, 3>& low, const std::array<float, 3>& high,
                   Visit visit) const {
    constexpr std::int64_t kMask = (1 << 21) - 1;
    const auto cell = [&](float x) { return static_cast<std::int64_t>(std::floor(x * per_m_)); };
    for (std::int64_t x = cell(low[0]); x <= cell(high[0]); ++x)
      for (std::int64_t y = cell(low[1]); y <= cell(high[1]); ++y)
        for (std::int64_t z = cell(low[2]); z <= cell(high[2]); ++z)
          visit(static_cast<std::uint64_t>((x & kMask) << 42 | (y & kMask) << 21 | (z & kMask)));
  }

  float per_m_;
  int count_ = 0;
  std::unordered_map<std::uint64_t, std::vector<std::pair<Range, int>>> items_;
};

/// Depths of a surface in the objects of a scene, sampled in steps of kLook_m.
struct MeshDepths {
  std::optional<Real> to_object;  ///< smallest distance of a node; absent without objects
  Real to_table = 0;
  Real deepest = 0;
  Real over = 0;     ///< largest excess over allowed_between_m()
  Real through = 0;  ///< fraction of an object's thickness, see through_of()
};

/// Surface of four flat facets per triangle, between its corners and the midpoints of its edges,
/// each placed at the mean of the adjacent quadratics. Nodes are the points, then the midpoints.
class MeshSurface {
 public:
  /// `quadratics` are those of the triangles, in the same order.
  MeshSurface(const MeshRest& rest, const std::vector<Quadratic>& quadratics);

  /// `held` marks points held by pins or clamps.
  [[nodiscard]] MeshDepths depths(const Objects& objects, const std::vector<bool>& held) const;
  /// Adds a stated force at a point of a facet, given by its nodes, to points and edges, as far as
  /// contact can exert it. Returns false without such a point, or if it is farther than kTouch_m
  /// outside the object. Forces between layers act at the nearest points of a node and a facet, or
  /// of two facet edges, without common nodes. These points must be closer than the rest's
  /// thickness and than a quarter of their distance on the flat piece.
  [[nodiscard]] bool add(const Objects& objects, const ContactForce& stated,
                         std::vector<Point>& on_points, std::vector<Point>& on_sides);
  /// Number of pairs of an edge and a facet that intersect and have no common node.
  [[nodiscard]] int crossings() const;
  /// Position of a material point (m), by the quadratic through the six nodes of its triangle;
  /// nullopt outside the cloth.
  [[nodiscard]] std::optional<Eigen::Vector3d> place(const Eigen::Vector2d& material_m) const;

  [[nodiscard]] Real deepest_pressed() const { return deepest_pressed_; }
  [[nodiscard]] const std::optional<Real>& nearest_layers() const { return nearest_layers_; }

 private:
  using Nodes = std::array<int, 3>;
  /// Weights of points and edges at a position on the surface.
  struct Mixture {
    std::map<int, Real> points, sides;
  };
  [[nodiscard]] bool is_piece(std::vector<int> nodes) const;
  [[nodiscard]] std::optional<Point> layer_force(const ContactForce& stated, int firsts,
                                                 Real friction);
  [[nodiscard]] std::optional<Point> object_force(const Objects& objects,
                                                  const ContactForce& stated);

  const MeshRest& rest_;
  std::vector<Mixture> middles_;
  std::vector<Point> nodes_, flat_;  ///< in space, and in material coordinates (warp, weft, 0)
  std::vector<Nodes> facets_, sorted_;
  std::vector<std::array<int, 2>> edges_;  ///< edges of facets, sorted, without repetition
  mutable std::optional<Lattice> by_material_;
  Real deepest_pressed_ = 0;
  std::optional<Real> nearest_layers_;
};

}  // namespace drape::simulate::checker
