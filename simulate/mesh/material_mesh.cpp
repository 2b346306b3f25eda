// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/material_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "core/error.hpp"
#include "core/geometry/vectors.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;

constexpr double kNear = 0.6;    // distance of inner points from lines, relative to the spacing
constexpr double kSame = 1e-6;   // relative to the spacing; closer points are the same
constexpr double kExact = 1e-6;  // tolerance of area and border, relative to the outline's
constexpr double kThin = 1e-9;   // relative to the squared longest edge; smaller areas are zero

double length_of(const Polygon& polygon) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    sum += (polygon[(i + 1) % polygon.size()] - polygon[i]).norm();
  return sum;
}

bool is_cloth(const ClothOutline& outline, const Vector2d& p) {
  return contains(outline.outer, p) &&
         std::none_of(outline.holes.begin(), outline.holes.end(),
                      [&](const Polygon& hole) { return contains(hole, p); });
}

/// A straight segment that triangles must not cross, with its junctions with others.
struct Side {
  Vector2d from, to;
  bool open = false;  ///< part of an open line, not of a polygon
  std::vector<Vector2d> cuts = {};

  [[nodiscard]] double distance_m(const Vector2d& p) const {
    return simulate::distance_m({from, to}, p);
  }
  /// Points that divide the segment at the spacing, without its end.
  [[nodiscard]] std::vector<Vector2d> points(double spacing) const {
    std::vector<Vector2d> ends = cuts, points;
    ends.push_back(to);
    std::sort(ends.begin(), ends.end(), [&](const Vector2d& p, const Vector2d& q) {
      return (p - from).squaredNorm() < (q - from).squaredNorm();
    });
    Vector2d a = from;
    for (const Vector2d& b : ends) {
      if ((b - a).norm() <= kSame * spacing) continue;
      const int pieces = std::max(1, static_cast<int>(std::lround((b - a).norm() / spacing)));
      for (int k = 0; k < pieces; ++k) points.emplace_back(a + (b - a) * k / pieces);
      a = b;
    }
    return points;
  }
};

/// Splits two segments where they meet.
void cut_at_meeting(Side& a, Side& b, double near) {
  for (const Vector2d& end : {b.from, b.to})
    if (a.distance_m(end) <= near) a.cuts.push_back(end);
  for (const Vector2d& end : {a.from, a.to})
    if (b.distance_m(end) <= near) b.cuts.push_back(end);
  const Vector2d u = a.to - a.from, v = b.to - b.from, between = b.from - a.from;
  const double area = cross(u, v);
  if (std::abs(area) <= kThin * u.norm() * v.norm()) return;
  const double on_a = cross(between, v) / area, on_b = cross(between, u) / area;
  if (on_a <= 0 || on_a >= 1 || on_b <= 0 || on_b >= 1) return;
  a.cuts.emplace_back(a.from + on_a * u);
  b.cuts.push_back(a.cuts.back());
}

/// Splits an open line at the foot of a nearby named point that lies between the line's points.
void cut_beside(Side& line, const Vector2d& named, double spacing) {
  const double away = line.distance_m(named);
  if (away <= kSame * spacing || away >= kNear * spacing) return;
  const Vector2d along = (line.to - line.from).normalized();
  const double at = along.dot(named - line.from);
  if (at > 0 && at < (line.to - line.from).norm()) line.cuts.emplace_back(line.from + at * along);
}

/// Points of all lines without repetition: those of polygons, then those of open lines.
std::vector<Vector2d> line_points(const ClothOutline& outline,
                                  const std::vector<const Polygon*>& polygons, double h) {
  std::vector<Side> sides;
  for (const Polygon* polygon : polygons)
    for (std::size_t i = 0; i < polygon->size(); ++i)
      sides.push_back({(*polygon)[i], (*polygon)[(i + 1) % polygon->size()]});
  for (const auto& [from, to] : outline.lines) sides.push_back({from, to, true});
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (!sides[i].open) continue;
    for (std::size_t k = 0; k < i; ++k) cut_at_meeting(sides[k], sides[i], kSame * h);
    for (const Vector2d& named : outline.points) cut_beside(sides[i], named, h);
  }
  std::vector<Vector2d> points;
  const auto add_once = [&](const Vector2d& p) {
    if (std::none_of(points.begin(), points.end(),
                     [&](const Vector2d& q) { return (p - q).norm() <= 2 * kSame * h; }))
      points.push_back(p);
  };
  for (std::size_t i = 0; i < sides.size(); ++i) {
    std::vector<Vector2d> own = sides[i].points(h);
    if (!sides[i].open) {
      points.insert(points.end(), own.begin(), own.end());
      continue;
    }
    own.push_back(sides[i].to);
    for (const Vector2d& p : own) {
      const bool elsewhere =
          std::any_of(sides.begin(), sides.begin() + static_cast<long>(i),
                      [&](const Side& s) { return s.distance_m(p) <= kSame * h; });
      if (!elsewhere) add_once(p);
    }
  }
  return points;
}

/// Throws Error(bad_input) if a line of the outline is not represented by edges of the mesh.
void require_sides(const ClothOutline& outline, const MaterialMesh& mesh, double h) {
  for (const auto& [from, to] : outline.lines) {
    double missing = (to - from).norm();
    for (const MaterialMesh::Edge& edge : mesh.edges) {
      const Vector2d &a = mesh.points_m[edge.from], &b = mesh.points_m[edge.to];
      if (distance_m({from, to}, a) <= 2 * kSame * h && distance_m({from, to}, b) <= 2 * kSame * h)
        missing -= (b - a).norm();
    }
    if (missing > kExact * (to - from).norm())
      throw bad_input(
          fmt::format("the line from warp {:.1f}, weft {:.1f} mm to {:.1f}, {:.1f} mm is not "
                      "followed by the mesh",
                      from.x() / units::mm, from.y() / units::mm, to.x() / units::mm,
                      to.y() / units::mm),
          {.file = outline.file.string()}, "give a finer --spacing-mm, or move pins off it");
  }
}

std::vector<std::array<int, 3>> cloth_triangles(const ClothOutline& outline,
                                                const std::vector<Vector2d>& points) {
  std::vector<std::array<int, 3>> kept;
  for (const auto& t : delaunay(points)) {
    const Vector2d &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
    const double longest =
        std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    // Along a straight line the triangulation may leave degenerate triangles.
    if (cross(b - a, c - a) > kThin * longest && is_cloth(outline, (a + b + c) / 3))
      kept.push_back(t);
  }
  return kept;
}

/// Adds the points that the caller names. A named point on a line close to a regular point of it
/// replaces that point, unless other lines meet there.
void add_named(const ClothOutline& outline, const std::vector<const Polygon*>& polygons, double h,
               std::vector<Vector2d>& points) {
  const auto is_corner = [&](const Vector2d& p) {
    return std::any_of(polygons.begin(), polygons.end(),
                       [&](const Polygon* polygon) {
                         return std::find(polygon->begin(), polygon->end(), p) != polygon->end();
                       }) ||
           std::any_of(outline.lines.begin(), outline.lines.end(), [&](const auto& line) {
             return (line[0] - p).norm() <= kSame * h || (line[1] - p).norm() <= kSame * h;
           });
  };
  const auto is_named = [&](const Vector2d& p) {
    return std::find(outline.points.begin(), outline.points.end(), p) != outline.points.end();
  };
  const auto on_line = [&](const Vector2d& p) {
    return std::any_of(
               polygons.begin(), polygons.end(),
               [&](const Polygon* polygon) { return distance_m(*polygon, p) <= kSame * h; }) ||
           std::any_of(outline.lines.begin(), outline.lines.end(), [&](const auto& line) {
             return distance_m({line[0], line[1]}, p) <= kSame * h;
           });
  };
  for (const Vector2d& named : outline.points) {
    const auto nearest =
        std::min_element(points.begin(), points.end(), [&](const Vector2d& a, const Vector2d& b) {
          return (a - named).squaredNorm() < (b - named).squaredNorm();
        });
    const double away = (*nearest - named).norm();
    if (away < kSame * h || (away < kNear / 2 * h && !is_corner(*nearest) && !is_named(*nearest) &&
                             on_line(*nearest) && on_line(named))) {
      *nearest = named;
    } else {
      points.push_back(named);
    }
  }
}

long double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (static_cast<long double>(b.x()) - a.x()) * (static_cast<long double>(c.y()) - a.y()) -
         (static_cast<long double>(b.y()) - a.y()) * (static_cast<long double>(c.x()) - a.x());
}

/// Positive if `d` lies inside the circle through a, b, c (counter-clockwise).
long double in_circle(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const auto row = [&](const Vector2d& p) {
    const long double x = static_cast<long double>(p.x()) - d.x();
    const long double y = static_cast<long double>(p.y()) - d.y();
    return std::array<long double, 3>{x, y, x * x + y * y};
  };
  const auto u = row(a), v = row(b), w = row(c);
  return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
         u[2] * (v[0] * w[1] - v[1] * w[0]);
}

/// A triangle with its neighbours; neighbour k is across the edge opposite corner k.
struct Face {
  std::array<int, 3> corner;
  std::array<int, 3> beside;
  bool alive = true;
};

class Triangulation {
 public:
  explicit Triangulation(std::vector<Vector2d> points) : points_(std::move(points)) {
    const std::size_t n = points_.size();
    const Eigen::AlignedBox2d box = box_of(points_);
    const Vector2d middle = (box.min() + box.max()) / 2;
    const double size = 100 * ((box.max() - box.min()).maxCoeff() + 1e-9);
    points_.push_back(middle + size * Vector2d(-1, -1));
    points_.push_back(middle + size * Vector2d(1, -1));
    points_.push_back(middle + size * Vector2d(0, 1.5));
    const int first = static_cast<int>(n);
    faces_.push_back({{first, first + 1, first + 2}, {-1, -1, -1}});
    for (int i = 0; i < first; ++i) insert(i);
  }

  [[nodiscard]] std::vector<std::array<int, 3>> triangles() const {
    const int n = static_cast<int>(points_.size()) - 3;
    std::vector<std::array<int, 3>> result;
    for (const Face& face : faces_) {
      if (face.alive && std::all_of(face.corner.begin(), face.corner.end(),
                                    [n](int corner) { return corner < n; }))
        result.push_back(face.corner);
    }
    return result;
  }

 private:
  [[nodiscard]] const Vector2d& at(int corner) const { return points_[corner]; }

  /// Finds the face that contains the point, walking from the last face.
  [[nodiscard]] int holder(const Vector2d& p) const {
    int face = last_;
    for (std::size_t steps = 0; steps < faces_.size() + 10; ++steps) {
      int next = -1;
      for (int k = 0; k < 3 && next < 0; ++k) {
        const auto& corner = faces_[face].corner;
        if (turn(at(corner[(k + 1) % 3]), at(corner[(k + 2) % 3]), p) < 0)
          next = faces_[face].beside[k];
      }
      if (next < 0) return face;
      face = next;
    }
    return face;
  }

  void insert(int point) {
    const Vector2d& p = at(point);
    std::vector<int> cavity = {holder(p)};
    faces_[cavity[0]].alive = false;
    struct Rim {
      int from, to, outside;
    };
    std::vector<Rim> rim;
    for (std::size_t i = 0; i < cavity.size(); ++i) {
      const Face face = faces_[cavity[i]];
      for (int k = 0; k < 3; ++k) {
        const int other = face.beside[k];
        if (other >= 0 && !faces_[other].alive) continue;
        const auto inside = [&] {
          const auto& c = faces_[other].corner;
          return in_circle(at(c[0]), at(c[1]), at(c[2]), p) > 0;
        };
        if (other >= 0 && inside()) {
          faces_[other].alive = false;
          cavity.push_back(other);
        } else {
          rim.push_back({face.corner[(k + 1) % 3], face.corner[(k + 2) % 3], other});
        }
      }
    }
    std::map<int, int> starting;  // face whose edge towards `point` starts at this corner
    const int first = static_cast<int>(faces_.size());
    for (const Rim& edge : rim) {
      starting[edge.from] = static_cast<int>(faces_.size());
      faces_.push_back({{point, edge.from, edge.to}, {edge.outside, -1, -1}});
      if (edge.outside < 0) continue;
      Face& outside = faces_[edge.outside];
      for (int k = 0; k < 3; ++k)
        if (outside.corner[(k + 1) % 3] == edge.to && outside.corner[(k + 2) % 3] == edge.from)
          outside.beside[k] = starting[edge.from];
    }
    for (int face = first; face < static_cast<int>(faces_.size()); ++face) {
      const int next = starting.at(faces_[face].corner[2]);
      faces_[face].beside[1] = next;
      faces_[next].beside[2] = face;
    }
    last_ = first;
  }

  std::vector<Vector2d> points_;
  std::vector<Face> faces_;
  int last_ = 0;
};

}  // namespace

Eigen::AlignedBox2d box_of(const std::vector<Vector2d>& points) {
  Eigen::AlignedBox2d box;
  for (const Vector2d& p : points) box.extend(p);
  return box;
}

bool contains(const Polygon& polygon, const Vector2d& p) {
  bool in = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
      in = !in;
  }
  return in;
}

double distance_m(const Polygon& polygon, const Vector2d& p) {
  double least = 1e300;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], along = polygon[(i + 1) % polygon.size()] - a;
    const double t = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (p - a - t * along).norm());
  }
  return least;
}

bool is_on(const ClothOutline& outline, const Vector2d& p, double near_m) {
  if (!contains(outline.outer, p) && distance_m(outline.outer, p) > near_m) return false;
  return std::none_of(outline.holes.begin(), outline.holes.end(), [&](const Polygon& hole) {
    return contains(hole, p) && distance_m(hole, p) > near_m;
  });
}

Polygon circle(const Vector2d& centre_m, double radius_m, int count, double turn_rad) {
  Polygon polygon;
  for (int i = 0; i < count; ++i) {
    const double angle = turn_rad + 2 * std::numbers::pi * i / count;
    polygon.emplace_back(centre_m + radius_m * Vector2d(std::cos(angle), std::sin(angle)));
  }
  return polygon;
}

double MaterialMesh::area_m2(int triangle) const {
  const auto& t = triangles[triangle];
  return cross(points_m[t[1]] - points_m[t[0]], points_m[t[2]] - points_m[t[0]]) / 2;
}

double MaterialMesh::area_m2() const {
  double sum = 0;
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t) sum += area_m2(t);
  return sum;
}

double MaterialMesh::mean_side_m() const {
  double sum = 0;
  for (const Edge& edge : edges) sum += (points_m[edge.to] - points_m[edge.from]).norm();
  return sum / static_cast<double>(edges.size());
}

double MaterialMesh::border_m() const {
  double sum = 0;
  for (const Edge& edge : edges)
    if (edge.left < 0 || edge.right < 0) sum += (points_m[edge.to] - points_m[edge.from]).norm();
  return sum;
}

MaterialMesh mesh_of(std::vector<Vector2d> points_m, std::vector<std::array<int, 3>> triangles) {
  MaterialMesh mesh;
  mesh.points_m = std::move(points_m);
  mesh.triangles = std::move(triangles);
  const auto refuse = [](std::size_t triangle, const char* what) {
    throw bad_input(fmt::format("triangle {}: {}", triangle, what), {}, "mend the mesh");
  };
  std::map<std::pair<int, int>, MaterialMesh::Edge> edges;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const int corner : mesh.triangles[t])
      if (corner < 0 || corner >= static_cast<int>(mesh.points_m.size()))
        refuse(t, "a corner that is no point");
    if (!(mesh.area_m2(static_cast<int>(t)) > 0)) refuse(t, "no area, or clockwise");
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles[t][(k + 1) % 3], b = mesh.triangles[t][(k + 2) % 3];
      MaterialMesh::Edge& edge = edges[std::minmax(a, b)];
      int& side = a < b ? edge.left : edge.right;
      if (side >= 0) refuse(t, "an edge between more than two triangles");
      side = static_cast<int>(t);
    }
  }
  std::map<std::pair<int, int>, int> index;
  for (auto& [ends, edge] : edges) {
    edge.from = ends.first;
    edge.to = ends.second;
    index[ends] = static_cast<int>(mesh.edges.size());
    mesh.edges.push_back(edge);
  }
  for (const auto& t : mesh.triangles) {
    std::array<int, 3> own{};
    for (int k = 0; k < 3; ++k) own[k] = index.at(std::minmax(t[(k + 1) % 3], t[(k + 2) % 3]));
    mesh.edges_of.push_back(own);
  }
  return mesh;
}

std::vector<int> border_of(const MaterialMesh& mesh) {
  std::map<int, int> next;
  for (const MaterialMesh::Edge& edge : mesh.edges) {
    if (edge.left >= 0 && edge.right < 0) next[edge.from] = edge.to;
    if (edge.right >= 0 && edge.left < 0) next[edge.to] = edge.from;
  }
  std::vector<int> longest;
  while (!next.empty()) {
    std::vector<int> loop;
    for (int at = next.begin()->first; next.contains(at);) {
      loop.push_back(at);
      const int to = next.at(at);
      next.erase(at);
      at = to;
    }
    if (loop.size() > longest.size()) longest = loop;
  }
  return longest;
}

MaterialMesh triangulated(const ClothOutline& outline, const MeshOptions& options) {
  const double h = options.spacing_m;
  const Where where{.file = outline.file.string()};
  std::vector<const Polygon*> lines = {&outline.outer};
  for (const auto* more : {&outline.holes, &outline.creases})
    for (const Polygon& polygon : *more) lines.push_back(&polygon);
  double area = std::abs(signed_area(outline.outer));
  double border = length_of(outline.outer);
  for (const Polygon& hole : outline.holes) {
    area -= std::abs(signed_area(hole));
    border += length_of(hole);
  }
  for (const Polygon* line : lines) {
    if (line->size() < 3 || !(h > 0))
      throw bad_input("an outline of the cloth has fewer than three corners", where,
                      "give each ring three corners or more");
    if (const double inside = std::abs(signed_area(*line)); inside < h * h)
      throw bad_input(
          fmt::format(
              "the ring from warp {:.1f}, weft {:.1f} mm on has an area of {:.3g} mm2, less "
              "than a square of the mesh's spacing",
              line->front().x() / units::mm, line->front().y() / units::mm, inside * 1e6),
          where, "make it wider or the mesh finer (--spacing-mm)");
  }
  std::vector<Vector2d> points = line_points(outline, lines, h);
  add_named(outline, lines, h, points);
  const std::size_t fixed = points.size();
  const Eigen::AlignedBox2d box = box_of(outline.outer);
  const Vector2d middle = (box.min() + box.max()) / 2;
  const int reach = static_cast<int>((box.max() - box.min()).norm() / h) + 2;
  const double c = std::cos(options.lattice_turn_rad), s = std::sin(options.lattice_turn_rad);
  SplitMix64 random(options.seed);
  const auto offset = [&] { return options.jitter * h * (2 * random.uniform() - 1); };
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      const Vector2d lattice((j + 0.5 * (i & 1)) * h, i * h * std::sqrt(3.0) / 2);
      const Vector2d moved(offset(), offset());
      const Vector2d p =
          middle + Vector2d(c * lattice.x() - s * lattice.y(), s * lattice.x() + c * lattice.y()) +
          moved;
      if (is_cloth(outline, p) &&
          std::all_of(lines.begin(), lines.end(),
                      [&](const Polygon* line) { return distance_m(*line, p) >= kNear * h; }) &&
          std::all_of(outline.lines.begin(), outline.lines.end(),
                      [&](const auto& line) {
                        return distance_m({line[0], line[1]}, p) >= kNear * h;
                      }) &&
          std::all_of(outline.points.begin(), outline.points.end(),
                      [&](const Vector2d& named) { return (named - p).norm() >= kNear * h; }))
        points.push_back(p);
    }
  }
  std::vector<std::array<int, 3>> triangles = cloth_triangles(outline, points);
  for (int round = 0; round < options.smoothing; ++round) {
    std::vector<Vector2d> sum(points.size(), Vector2d::Zero());
    std::vector<int> count(points.size(), 0);
    for (const auto& t : triangles) {
      for (int k = 0; k < 3; ++k) {
        sum[t[k]] += points[t[(k + 1) % 3]] + points[t[(k + 2) % 3]];
        count[t[k]] += 2;
      }
    }
    for (std::size_t i = fixed; i < points.size(); ++i)
      if (count[i] > 0) points[i] = sum[i] / count[i];
    triangles = cloth_triangles(outline, points);
  }
  MaterialMesh mesh = mesh_of(std::move(points), std::move(triangles));
  std::vector<bool> used(mesh.points_m.size(), false);
  for (const auto& t : mesh.triangles)
    for (const int corner : t) used[static_cast<std::size_t>(corner)] = true;
  if (const auto alone = std::find(used.begin(), used.end(), false); alone != used.end()) {
    const Vector2d at = mesh.points_m[static_cast<std::size_t>(alone - used.begin())];
    throw bad_input(fmt::format("the point of the mesh at warp {:.3g}, weft {:.3g} mm is in no "
                                "triangle",
                                at.x() * 1e3, at.y() * 1e3),
                    where, "is a corner there twice?");
  }
  // Area alone misses a torn mesh or one that bridges a gap: its border is longer or shorter.
  if (std::abs(mesh.area_m2() - area) > kExact * area ||
      std::abs(mesh.border_m() - border) > kExact * border)
    throw bad_input(
        fmt::format("the mesh covers {:.6g} mm2 with a border of {:.6g} mm, the outline {:.6g} mm2 "
                    "with {:.6g} mm",
                    mesh.area_m2() * 1e6, mesh.border_m() * 1e3, area * 1e6, border * 1e3),
        where, "the outline is finer than the spacing: give a finer mesh");
  require_sides(outline, mesh, h);
  return mesh;
}

std::vector<std::array<int, 3>> delaunay(const std::vector<Vector2d>& points) {
  if (points.size() < 3) return {};
  return Triangulation(points).triangles();
}

}  // namespace drape::simulate
