// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/scene.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace drape::simulate::checker {

namespace {

Real length_of(Real a, Real b, Real c = 0) {
  return std::sqrt(a * a + b * b + c * c);
}

/// Coordinates of p in an object's frame.
Point in_frame(const WorldFromObject& frame, const Point& p) {
  Point q{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      q[i] += Real(frame.rotation(j, i)) * (p[j] - Real(frame.translation_m[j]));
  }
  return q;
}

/// Distance from a body shrunk by `radius` along each direction, then grown by it again.
Real rounded(Real a, Real b, Real c, Real radius) {
  const Real outside = length_of(std::max<Real>(a, 0), std::max<Real>(b, 0), std::max<Real>(c, 0));
  return outside + std::min<Real>(0, std::max({a, b, c})) - radius;
}

struct Gap {
  const Objects& objects;
  std::size_t k;
  const Point& p;

  Real operator()(const Sphere& s) const {
    return length_of(p[0] - Real(s.centre_in_world[0]), p[1] - Real(s.centre_in_world[1]),
                     p[2] - Real(s.centre_in_world[2])) -
           Real(s.radius_m);
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
    const Real across = length_of(q[0], q[1]) - Real(body.radius_m) + Real(body.edge_radius_m);
    const Real along = std::abs(q[2]) - Real(body.height_m) / 2 + Real(body.edge_radius_m);
    return rounded(across, along, std::min({across, along, Real(0)}), body.edge_radius_m);
  }
  Real operator()(const Plane& plane) const {
    Real sum = 0;
    for (int i = 0; i < 3; ++i)
      sum += Real(plane.normal_in_world[i]) * (p[i] - Real(plane.point_in_world[i]));
    return sum;
  }
  Real operator()(const MeshObject&) const {
    return objects.meshes[k]->gap_m(
        0, {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
  }
};

Point mix(const std::vector<Point>& points, Support support) {
  Point sum{};
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < 4; ++k) sum[axis] += support.weight[k] * points[support.particle[k]][axis];
  }
  return sum;
}

Support cell_place(int corner, int cols, Real u, Real v) {
  return {{corner, corner + 1, corner + cols, corner + cols + 1},
          {(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v},
          {},
          false};
}

Support line_place(int a, int b, Real t) {
  Support place;
  place.particle = {a, b, a, b};
  place.weight[0] = 1 - t;
  place.weight[1] = t;
  return place;
}

constexpr Real kSameFace = 1 - 1e-9L;  // cosine; between normals of a face, by differences
constexpr std::array<std::pair<int, int>, 4> kNeighbours{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

/// Collects the places where the sheet may touch.
class Finder {
 public:
  Finder(const Objects& objects, const std::vector<Point>& points, Real touch_m)
      : objects_(objects), points_(points), touch_m_(touch_m) {}

  Real gap(std::size_t k, const Support& place) const {
    return gap_of(objects_, k, mix(points_, place));
  }
  void add(std::size_t k, Support place) {
    const Point p = mix(points_, place);
    place.normal = normal_of(objects_, k, p);
    last_ = found_.size();
    found_.push_back(place);
    last_end_ = found_.size();
    const std::size_t first = last_;
    for (const Point& normal : sharp_normals_of(objects_, k, p)) {
      place.normal = normal;
      bool known = false;
      for (std::size_t s = first; s < found_.size(); ++s) {
        const Point& n = found_[s].normal;
        known = known ||
                n[0] * place.normal[0] + n[1] * place.normal[1] + n[2] * place.normal[2] > 0.999L;
      }
      if (!known) found_.push_back(place);
    }
    last_end_ = found_.size();
  }
  /// A place beside the last one added, which presses in that one's directions and in its own: on a
  /// narrow rounding they differ.
  void beside(std::size_t shape, const Support& place) {
    Support other = place;
    for (std::size_t s = last_; s < last_end_; ++s) {
      other.normal = found_[s].normal;
      found_.push_back(other);
    }
    other.normal = normal_of(objects_, shape, mix(points_, place));
    found_.push_back(other);
  }
  /// Where the cell is deepest, and its neighbours, as for a line.
  void try_deepest(std::size_t k, int corner, int cols) {
    const auto at = [corner, cols](Real u, Real v) { return cell_place(corner, cols, u, v); };
    Real u = 0.5L, v = 0.5L, least = gap(k, at(u, v));
    if (least > touch_m_ + length_between(at(0, 0), at(1, 1)) + length_between(at(0, 1), at(1, 0)))
      return;
    for (Real step = 0.25L; step > 1e-4L;) {
      bool moved = false;
      for (const auto& [du, dv] : kNeighbours) {
        const Real s = std::clamp<Real>(u + du * step, 0, 1),
                   t = std::clamp<Real>(v + dv * step, 0, 1);
        const Real here = gap(k, at(s, t));
        if (here >= least) continue;
        least = here;
        u = s;
        v = t;
        moved = true;
      }
      if (!moved) step /= 2;
    }
    if (least > touch_m_) return;
    add(k, at(u, v));
    // The simulator's place is as deep to within its contacts' sinking.
    for (const Real by : {0.02L, 0.06L}) {
      for (const auto& [du, dv] : kNeighbours)
        beside(k, at(std::clamp<Real>(u + du * by, 0, 1), std::clamp<Real>(v + dv * by, 0, 1)));
    }
  }
  [[nodiscard]] Real length_between(const Support& one, const Support& two) const {
    const Point p = mix(points_, one), q = mix(points_, two);
    return length_of(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
  }
  void try_place(std::size_t k, const Support& place) {
    if (gap(k, place) <= touch_m_) add(k, place);
  }
  /// The nearest place by samples and golden sections, and its neighbours, so that a contact whose
  /// place along the line is known to a hundredth can be made up of two.
  void try_line(std::size_t k, int a, int b) {
    const auto at = [a, b](Real t) { return line_place(a, b, t); };
    constexpr int kSamples = 16;
    int best = 1;
    Real least = 1e9L;
    for (int s = 1; s < kSamples; ++s) {
      const Real here = gap(k, at(Real(s) / kSamples));
      if (here < least) {
        least = here;
        best = s;
      }
    }
    // Distances change by no more than the length along the line.
    if (least > touch_m_ + length_between(at(0), at(1)) / kSamples) return;
    // Where the line lies along a face, any place of it may press, up to the edges.
    for (int s = 1; s < kSamples; ++s) {
      try_place(k, at(Real(s) / kSamples));
      for (const int beside : {s - 1, s + 1})
        try_edges(k, at, Real(s) / kSamples, Real(beside) / kSamples);
    }
    Real low = Real(best - 1) / kSamples;
    Real high = Real(best + 1) / kSamples;
    constexpr Real kGolden = 0.618033988749894848L;
    for (int step = 0; step < 24; ++step) {
      const Real one = high - kGolden * (high - low);
      const Real two = low + kGolden * (high - low);
      if (gap(k, at(one)) < gap(k, at(two))) {
        high = two;
      } else {
        low = one;
      }
    }
    const Real t = (low + high) / 2;
    if (gap(k, at(t)) > touch_m_) return;
    add(k, at(t));
    for (const Real shift : {-0.01L, 0.01L}) beside(k, at(std::clamp<Real>(t + shift, 0, 1)));
    // All of the piece that is near enough may press, each place in its own direction: on a narrow
    // rounding the direction changes within a small part of a millimetre.
    for (const Real side : {-1.0L / kSamples, 1.0L / kSamples}) {
      const Real end = reach_of([&](Real fraction) { return gap(k, at(t + fraction * side)); });
      constexpr int kPlaces = 4;
      for (int place = 1; place <= kPlaces; ++place)
        try_place(k, at(std::clamp<Real>(t + side * end * place / kPlaces, 0, 1)));
    }
  }
  /// The last places between two of a line, the first near enough, that press in that one's
  /// direction, and that are near enough: a line along a face may press on either end of it.
  template <class At>
  void try_edges(std::size_t k, At at, Real from, Real to) {
    if (gap(k, at(from)) > touch_m_) return;
    const auto place = [&](Real fraction) { return at(from + fraction * (to - from)); };
    const auto normal = [&](Real fraction) {
      return normal_of(objects_, k, mix(points_, place(fraction)));
    };
    const Point here = normal(0);
    const auto gap_at = [&](Real fraction) { return gap(k, place(fraction)); };
    const Real on_face = reach_of([&](Real fraction) {
      return dot(normal(fraction), here) > kSameFace ? gap_at(fraction) : HUGE_VALL;
    });
    if (on_face == 1) return;
    try_place(k, place(on_face));
    try_place(k, place(reach_of(gap_at)));
  }
  /// The largest fraction up to 1 at which a gap, near enough at 0, is near enough still.
  template <class GapAt>
  [[nodiscard]] Real reach_of(GapAt gap_at) const {
    Real near = 0, far = 1;
    if (gap_at(far) <= touch_m_) return far;
    for (int halving = 0; halving < 24; ++halving) {
      const Real middle = (near + far) / 2;
      (gap_at(middle) <= touch_m_ ? near : far) = middle;
    }
    return near;
  }
  [[nodiscard]] std::vector<Support> take() { return std::move(found_); }

 private:
  const Objects& objects_;
  const std::vector<Point>& points_;
  Real touch_m_;
  std::vector<Support> found_;
  std::size_t last_ = 0, last_end_ = 0;  ///< the supports of the last place added
};

/// True if the object has edges without a radius.
bool is_sharp(const Objects& objects, std::size_t k) {
  if (k == objects.scene->obstacles.size()) return false;
  const Obstacle& object = objects.scene->obstacles[k];
  const auto* box = std::get_if<Box>(&object);
  const auto* cylinder = std::get_if<Cylinder>(&object);
  return std::holds_alternative<MeshObject>(object) ||
         (box != nullptr && box->edge_radius_m == 0) ||
         (cylinder != nullptr && cylinder->edge_radius_m == 0);
}

/// Along the principal axes, the least first.
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

constexpr Real kBeyond = 0.05L;  // relative to an edge or triangle: contacts there count as its own
constexpr Real kBesides = 20e-6L;  // m; the outward side is seen this far from the place
// Relative to that, from the solid: 0.045 rad off the edge's own directions
constexpr Real kAway = 0.999L;
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
  if (k == objects.scene->obstacles.size()) return p[2] - Real(objects.scene->table_z_m);
  return std::visit(Gap{objects, k, p}, objects.scene->obstacles[k]);
}

Point normal_of(const Objects& objects, std::size_t k, const Point& p) {
  // Mesh distances are doubles: their differences need a longer step.
  const bool mesh = k < objects.meshes.size() && objects.meshes[k] != nullptr;
  const Real step = mesh ? 1e-6L : 1e-9L;
  Point normal{};
  for (int axis = 0; axis < 3; ++axis) {
    Point before = p, after = p;
    before[axis] -= step;
    after[axis] += step;
    normal[axis] = gap_of(objects, k, after) - gap_of(objects, k, before);
  }
  const Real size = length_of(normal[0], normal[1], normal[2]);
  if (!(size > 0)) return {0, 0, 1};  // in the middle of an object, where no direction leads out
  for (Real& n : normal) n /= size;
  return normal;
}

std::vector<Point> sharp_normals_of(const Objects& objects, std::size_t k, const Point& p) {
  constexpr Real kAround = 20e-6L;
  std::vector<Point> normals;
  for (int cell = 0; is_sharp(objects, k) && cell < 27; ++cell) {
    const int row = cell / 3, layer = cell / 9;
    const Point off{Real(cell % 3 - 1), Real(row % 3 - 1), Real(layer - 1)};
    normals.push_back(normal_of(
        objects, k, {p[0] + kAround * off[0], p[1] + kAround * off[1], p[2] + kAround * off[2]}));
  }
  return normals;
}

Distances distances_of(const Objects& objects, const std::vector<Point>& points, int rows,
                       int cols) {
  constexpr int kPlaces = 8;
  Distances found;
  const std::size_t count = objects.scene->obstacles.size();
  for (std::size_t k = 0; k <= count; ++k) {
    for (const Point& p : points) {
      const Real gap = gap_of(objects, k, p);
      found.deepest_particle = std::max(found.deepest_particle, -gap);
      if (k < count) found.least_to_object = std::min(found.least_to_object.value_or(gap), gap);
    }
    for (int r = 0; r + 1 < rows; ++r) {
      for (int c = 0; c + 1 < cols; ++c) {
        for (int u = 0; u <= kPlaces; ++u) {
          for (int v = 0; v <= kPlaces; ++v) {
            const Support place =
                cell_place(r * cols + c, cols, Real(u) / kPlaces, Real(v) / kPlaces);
            found.deepest_between =
                std::max(found.deepest_between, -gap_of(objects, k, mix(points, place)));
          }
        }
      }
    }
  }
  return found;
}

std::vector<Support> supports_of(const Objects& objects, const std::vector<Point>& points, int rows,
                                 int cols, Real touch_m) {
  Finder finder(objects, points, touch_m);
  // Particles come first: they bear most, and the search for forces starts with them.
  for (std::size_t k = 0; k <= objects.scene->obstacles.size(); ++k) {
    for (int i = 0; i < rows * cols; ++i)
      finder.try_place(k, {{i, i, i, i}, {1, 0, 0, 0}, {}, false});
  }
  for (std::size_t k = 0; k <= objects.scene->obstacles.size(); ++k) {
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < cols; ++c) {
        const int i = r * cols + c;
        if (r + 1 < rows) finder.try_line(k, i, i + cols);
        if (c + 1 < cols) finder.try_line(k, i, i + 1);
        if (r + 1 == rows || c + 1 == cols) continue;
        for (int u = 1; u <= 3; ++u) {
          for (int v = 1; v <= 3; ++v)
            finder.try_place(k, cell_place(i, cols, Real(u) / 4, Real(v) / 4));
        }
        finder.try_deepest(k, i, cols);
        if (is_sharp(objects, k)) finder.try_line(k, i + 1, i + cols);
      }
    }
  }
  return finder.take();
}

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
