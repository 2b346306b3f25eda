// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/self_distance.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr int kNeighbourSteps = 3;
constexpr double kMostStrips = 1e6;

struct Triangle {
  std::array<Vector3d, 3> corner;
  std::array<int, 3> particle{};
  Vector3d centre;
  Eigen::Vector2d in_sheet;  ///< material place of its cell or centre, in steps along warp, weft
};

std::vector<Triangle> triangles_of(const std::vector<std::array<int, 3>>& facets,
                                   const std::vector<Eigen::Vector2d>& material_m, double step_m,
                                   const std::vector<Vector3d>& x) {
  std::vector<Triangle> all;
  for (const auto& f : facets) {
    Triangle t;
    t.particle = f;
    t.centre.setZero();
    t.in_sheet.setZero();
    for (int k = 0; k < 3; ++k) {
      t.corner[k] = x[f[k]];
      t.centre += t.corner[k] / 3;
      if (!material_m.empty()) t.in_sheet += material_m[f[k]] / (3 * step_m);
    }
    all.push_back(t);
  }
  return all;
}

/// Distance of a point from a triangle (Ericson, Real-Time Collision Detection, by Voronoi regions:
/// foot of the perpendicular if inside, else the nearest edge).
double point_triangle(const Vector3d& p, const Triangle& t) {
  const Vector3d u = t.corner[1] - t.corner[0], v = t.corner[2] - t.corner[0];
  const Vector3d normal = u.cross(v);
  const double area2 = normal.squaredNorm();
  double least = 1e300;
  if (area2 > 0) {
    const Vector3d w = p - t.corner[0];
    const double beta = w.cross(v).dot(normal) / area2;
    const double gamma = u.cross(w).dot(normal) / area2;
    if (beta >= 0 && gamma >= 0 && beta + gamma <= 1)
      return std::abs(w.dot(normal)) / std::sqrt(area2);
  }
  for (int k = 0; k < 3; ++k) {
    const Vector3d edge = t.corner[(k + 1) % 3] - t.corner[k];
    const double fraction =
        std::clamp((p - t.corner[k]).dot(edge) / std::max(1e-300, edge.squaredNorm()), 0.0, 1.0);
    least = std::min(least, (t.corner[k] + fraction * edge - p).norm());
  }
  return least;
}

/// Distance of two segments if their nearest points are inside both, else a large value: then a
/// nearest point is an end, which point_triangle() covers.
double edge_edge(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double det = uu * vv - uv * uv;
  if (det <= 1e-12 * uu * vv) return 1e300;
  const double s = (uv * v.dot(w) - vv * u.dot(w)) / det;
  const double t = (uu * v.dot(w) - uv * u.dot(w)) / det;
  if (s < 0 || s > 1 || t < 0 || t > 1) return 1e300;
  return (w + s * u - t * v).norm();
}

/// True if an edge of `one` intersects `t` and they have no particle in common.
bool pierces(const Triangle& one, const Triangle& t) {
  const Vector3d normal = (t.corner[1] - t.corner[0]).cross(t.corner[2] - t.corner[0]);
  const auto passes = [&](int from, int to) {
    for (const int particle : t.particle) {
      if (particle == one.particle[from] || particle == one.particle[to]) return false;
    }
    const Vector3d &a = one.corner[from], &b = one.corner[to];
    const double before = (a - t.corner[0]).dot(normal), after = (b - t.corner[0]).dot(normal);
    if (before * after >= 0) return false;
    const Vector3d p = a + before / (before - after) * (b - a);
    for (int k = 0; k < 3; ++k) {
      const Vector3d edge = t.corner[(k + 1) % 3] - t.corner[k];
      if (edge.cross(p - t.corner[k]).dot(normal) < 0) return false;
    }
    return true;
  };
  return passes(0, 1) || passes(1, 2) || passes(2, 0);
}

void judge_pair(const Triangle& one, const Triangle& two, SelfDistance& found, double& least) {
  if (pierces(one, two) || pierces(two, one)) {
    ++found.crossings;
    least = 0;
  }
  if ((one.in_sheet - two.in_sheet).cwiseAbs().maxCoeff() < kNeighbourSteps) return;
  for (int k = 0; k < 3; ++k) {
    const Vector3d &a = one.corner[k], &b = one.corner[(k + 1) % 3];
    least = std::min({least, point_triangle(a, two), point_triangle(two.corner[k], one)});
    for (int m = 0; m < 3; ++m)
      least = std::min(least, edge_edge(a, b, two.corner[m], two.corner[(m + 1) % 3]));
  }
}

/// Centres of triangles in strips across the sheet's second-longest extent, sorted along the
/// longest one, to find close pairs quickly.
class Strips {
 public:
  /// Supports pairs up to `width` apart.
  Strips(const std::vector<Triangle>& triangles, double width);
  /// Calls `use` with two triangles whose centres are within reach(), evaluated at that time.
  template <class Reach, class Use>
  void for_each_pair(const Reach& reach, const Use& use) const;

 private:
  struct Place {
    Vector3d centre;
    int triangle = 0;
    int strip = 0;
  };
  Eigen::Index along_ = 0;
  std::vector<Place> places_;
};

Strips::Strips(const std::vector<Triangle>& triangles, double width) {
  Eigen::AlignedBox3d extent;
  for (const Triangle& t : triangles) extent.extend(t.centre);
  Vector3d sizes = extent.sizes();
  sizes.maxCoeff(&along_);
  sizes[along_] = -1;
  Eigen::Index across = 0;
  sizes.maxCoeff(&across);
  const bool apart = !(sizes[across] < kMostStrips * width);  // one strip if sheet has flown apart
  for (const Triangle& t : triangles) {
    const double strip = apart ? 0 : (t.centre[across] - extent.min()[across]) / width;
    places_.push_back({t.centre, static_cast<int>(places_.size()), static_cast<int>(strip)});
  }
  std::stable_sort(places_.begin(), places_.end(), [&](const Place& a, const Place& b) {
    return a.strip != b.strip ? a.strip < b.strip : a.centre[along_] < b.centre[along_];
  });
}

template <class Reach, class Use>
void Strips::for_each_pair(const Reach& reach, const Use& use) const {
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Place& one = places_[i];
    const auto meet = [&](std::size_t from, int strip) {
      for (std::size_t j = from; j < places_.size() && places_[j].strip == strip; ++j) {
        const Place& two = places_[j];
        const double near = reach();
        if (two.centre[along_] - one.centre[along_] > near) break;
        if ((one.centre - two.centre).squaredNorm() <= near * near) use(one.triangle, two.triangle);
      }
    };
    meet(i + 1, one.strip);
    const auto before = [&](const Place& p) {
      return p.strip <= one.strip ||
             (p.strip == one.strip + 1 && p.centre[along_] < one.centre[along_] - reach());
    };
    const auto next = std::partition_point(places_.begin(), places_.end(), before);
    meet(static_cast<std::size_t>(next - places_.begin()), one.strip + 1);
  }
}

double largest_radius(const std::vector<Triangle>& triangles) {
  double radius = 0;
  for (const Triangle& t : triangles) {
    for (const Vector3d& corner : t.corner) radius = std::max(radius, (corner - t.centre).norm());
  }
  return radius;
}

bool any_pierces(const std::vector<Triangle>& triangles) {
  const double reach = 2 * largest_radius(triangles);
  const Strips strips(triangles, reach);
  bool passes = false;
  strips.for_each_pair([&] { return passes ? 0 : reach; },
                       [&](int i, int j) {
                         const Triangle &one = triangles[i], &two = triangles[j];
                         passes = passes || pierces(one, two) || pierces(two, one);
                       });
  return passes;
}

/// Searches for distances up to `cap`.
SelfDistance distance_of(const std::vector<Triangle>& triangles, double cap) {
  const double radius = largest_radius(triangles);
  const Strips strips(triangles, cap + 2 * radius);
  SelfDistance found;
  double least = cap;
  strips.for_each_pair([&] { return least + 2 * radius; },
                       [&](int i, int j) { judge_pair(triangles[i], triangles[j], found, least); });
  if (least < cap) found.least_m = least;
  return found;
}

}  // namespace

bool passes_through_itself(const std::vector<std::array<int, 3>>& facets,
                           const std::vector<Vector3d>& places) {
  return any_pierces(triangles_of(facets, {}, 1, places));
}

SelfDistance self_distance(const std::vector<std::array<int, 3>>& facets,
                           const std::vector<Eigen::Vector2d>& material_m, double step_m,
                           const std::vector<Vector3d>& places) {
  return distance_of(triangles_of(facets, material_m, step_m, places), step_m);
}

}  // namespace drape::simulate
