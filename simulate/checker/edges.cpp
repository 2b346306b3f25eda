// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace drape::simulate::checker {
namespace {

constexpr Real kBeyond = 0.05L;    // of an edge or triangle: contacts there count as its own
constexpr Real kBesides = 20e-6L;  // m; the outward side is seen this far from the place
constexpr Real kAway = 0.999L;  // of that, from the solid: 0.045 rad off the edge's own directions
constexpr Real kParallel = 1e-12L;

struct Edge {
  Point a, b;
};

struct Solid {
  std::size_t object = 0;
  std::vector<Point> corners;
  std::vector<Edge> edges;
};

Point along(const Point& a, const Point& displacement, Real fraction) {
  return {a[0] + fraction * displacement[0], a[1] + fraction * displacement[1],
          a[2] + fraction * displacement[2]};
}

Solid solid_of(const Box& box, std::size_t object) {
  Solid solid;
  solid.object = object;
  const WorldFromObject& frame = box.world_from_box;
  for (int k = 0; k < 8; ++k) {
    Point p{};
    for (int i = 0; i < 3; ++i) {
      p[i] = Real(frame.translation_m[i]);
      for (int j = 0; j < 3; ++j) {
        const Real half = Real(box.size_m[j]) / 2;
        p[i] += Real(frame.rotation(i, j)) * (((k >> j) & 1) != 0 ? half : -half);
      }
    }
    solid.corners.push_back(p);
  }
  for (int k = 0; k < 8; ++k) {
    for (int bit = 1; bit < 8; bit *= 2) {
      if ((k & bit) == 0) solid.edges.push_back({solid.corners[k], solid.corners[k | bit]});
    }
  }
  return solid;
}

Solid solid_of(const PlacedMesh& mesh, std::size_t object) {
  Solid solid;
  solid.object = object;
  for (const Eigen::Vector3d& corner : mesh.mesh->corners()) {
    const Eigen::Vector3d p = mesh.world_from_mesh * corner;
    solid.corners.push_back({p.x(), p.y(), p.z()});
  }
  for (const auto& triangle : mesh.mesh->triangles()) {
    for (int k = 0; k < 3; ++k) {
      const int from = triangle[k], to = triangle[(k + 1) % 3];
      if (from < to) solid.edges.push_back({solid.corners[from], solid.corners[to]});
    }
  }
  return solid;
}

class EdgeCollector {
 public:
  EdgeCollector(const Objects& objects, const std::vector<Point>& points, Real touch_m)
      : objects_(objects), points_(points), touch_m_(touch_m) {}

  void edge(std::size_t object, const Edge& solid, int i, int j) {
    const Point u = minus(points_[j], points_[i]), v = minus(solid.b, solid.a);
    const Point w = minus(points_[i], solid.a);
    const Real uu = dot(u, u), vv = dot(v, v), uv = dot(u, v);
    const Real det = uu * vv - uv * uv;
    if (!(det > kParallel * uu * vv)) return;
    const Real s = (uv * dot(v, w) - vv * dot(u, w)) / det;
    const Real t = (uu * dot(v, w) - uv * dot(u, w)) / det;
    if (s < -kBeyond || s > 1 + kBeyond || t < -kBeyond || t > 1 + kBeyond) return;
    const Point displacement = minus(along(points_[i], u, s), along(solid.a, v, t));
    if (dot(displacement, displacement) > touch_m_ * touch_m_) return;
    const Point place = along(solid.a, v, std::clamp(t, kBeyond, 1 - kBeyond));
    add(object, {{i, j, i, j}, {1 - s, s, 0, 0}, cross(u, v), false}, place);
  }

  void corner(std::size_t object, const Point& p, const std::array<int, 3>& t) {
    const Point u = minus(points_[t[1]], points_[t[0]]), v = minus(points_[t[2]], points_[t[0]]);
    const Point w = minus(p, points_[t[0]]), normal = cross(u, v);
    const Real area2 = dot(normal, normal);
    if (!(area2 > 0)) return;
    const Real height = dot(w, normal) / std::sqrt(area2);
    if (std::abs(height) > touch_m_) return;
    const Real s = dot(cross(w, v), normal) / area2, r = dot(cross(u, w), normal) / area2;
    if (s < -kBeyond || r < -kBeyond || s + r > 1 + kBeyond) return;
    add(object, {{t[0], t[1], t[2], t[0]}, {1 - s - r, s, r, 0}, normal, false}, p);
  }

  [[nodiscard]] std::vector<Support> take() { return std::move(found_); }

 private:
  /// `place` is of the edge or corner itself: beyond an edge's end is no solid that has sides. From
  /// there the direction in which the solid can press leads away from it and back to no nearer
  /// part.
  void add(std::size_t object, Support support, const Point& place) {
    const Real size = std::sqrt(dot(support.normal, support.normal));
    for (Real& n : support.normal) n /= size;
    const Real out = gap_of(objects_, object, along(place, support.normal, kBesides));
    const Real in = gap_of(objects_, object, along(place, support.normal, -kBesides));
    if (out < in) {
      for (Real& n : support.normal) n = -n;
    }
    if (std::max(out, in) >= kAway * kBesides) found_.push_back(support);
  }

  const Objects& objects_;
  const std::vector<Point>& points_;
  Real touch_m_;
  std::vector<Support> found_;
};

/// Bounds of a few points, grown.
struct Bounds {
  Point low{}, high{};
  explicit Bounds(const Point& p) : low(p), high(p) {}
  void take(const Point& p) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  [[nodiscard]] bool meets(const Bounds& other, Real by) const {
    bool apart = false;
    for (int axis = 0; axis < 3; ++axis)
      apart = apart || low[axis] > other.high[axis] + by || other.low[axis] > high[axis] + by;
    return !apart;
  }
};

}  // namespace

std::vector<Support> edge_supports_of(const Objects& objects, const std::vector<Point>& points,
                                      int rows, int cols, Real touch_m) {
  std::vector<Solid> solids;
  for (std::size_t k = 0; k < objects.scene->obstacles.size(); ++k) {
    const auto* box = std::get_if<Box>(&objects.scene->obstacles[k]);
    if (box != nullptr && box->edge_radius_m == 0) solids.push_back(solid_of(*box, k));
    if (objects.meshes[k] != nullptr) solids.push_back(solid_of(*objects.meshes[k]->mesh(0), k));
  }
  EdgeCollector collector(objects, points, touch_m);
  for (int r = 0; r + 1 < rows && !solids.empty(); ++r) {
    for (int c = 0; c + 1 < cols; ++c) {
      const int i = r * cols + c;
      Bounds cell(points[i]);
      for (const int k : {i + 1, i + cols, i + cols + 1}) cell.take(points[k]);
      // A contact a little beyond an edge counts; cells are a few centimetres at most.
      const Point size = minus(cell.high, cell.low);
      const Real margin = touch_m + kBeyond * std::sqrt(dot(size, size));
      for (const Solid& solid : solids) {
        for (const Edge& edge : solid.edges) {
          Bounds there(edge.a);
          there.take(edge.b);
          if (!cell.meets(there, margin)) continue;
          collector.edge(solid.object, edge, i, i + 1);
          collector.edge(solid.object, edge, i, i + cols);
          collector.edge(solid.object, edge, i + 1, i + cols);
          if (c + 2 == cols) collector.edge(solid.object, edge, i + 1, i + cols + 1);
          if (r + 2 == rows) collector.edge(solid.object, edge, i + cols, i + cols + 1);
        }
        for (const Point& corner : solid.corners) {
          if (!cell.meets(Bounds(corner), margin)) continue;
          collector.corner(solid.object, corner, {i, i + 1, i + cols});
          collector.corner(solid.object, corner, {i + 1, i + cols + 1, i + cols});
        }
      }
    }
  }
  return collector.take();
}

}  // namespace drape::simulate::checker
