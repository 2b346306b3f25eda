// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "simulate/checker/mesh_contact.hpp"

namespace drape::simulate::checker {
namespace {

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
