// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/layers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace drape::simulate::checker {
namespace {

/// A cell with its triangles and edges, diagonal included, and its box.
struct Cell {
  int row = 0, col = 0;
  std::array<std::array<int, 3>, 2> triangle{};
  std::array<std::array<int, 2>, 5> edge{};
  std::array<int, 4> corner{};
  Point low{}, high{};
};

std::vector<Cell> cells_of(const std::vector<Point>& points, int rows, int cols) {
  std::vector<Cell> cells;
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < cols; ++c) {
      const int i = r * cols + c;
      Cell cell;
      cell.row = r;
      cell.col = c;
      cell.corner = {i, i + 1, i + cols, i + cols + 1};
      cell.triangle = {{{i, i + 1, i + cols}, {i + 1, i + cols + 1, i + cols}}};
      cell.edge = {{{i, i + 1},
                    {i, i + cols},
                    {i + 1, i + cols},
                    {i + 1, i + cols + 1},
                    {i + cols, i + cols + 1}}};
      cell.low = cell.high = points[i];
      for (const int k : cell.corner) {
        for (int axis = 0; axis < 3; ++axis) {
          cell.low[axis] = std::min(cell.low[axis], points[k][axis]);
          cell.high[axis] = std::max(cell.high[axis], points[k][axis]);
        }
      }
      cells.push_back(cell);
    }
  }
  // Along the first axis, so that only near cells are compared.
  std::stable_sort(cells.begin(), cells.end(),
                   [](const Cell& a, const Cell& b) { return a.low[0] < b.low[0]; });
  return cells;
}

constexpr Real kNearestAllowed = 1e-6L;  // slope of the distance along a piece, where it is least
constexpr Real kWeightAllowed = 1e-12L;  // off from one, of a layer's weights

/// Calls visit(a, b) for cells at least `apart` rows or columns from each other whose boxes come
/// within `near_m`.
template <class Visit>
void visit_near(const std::vector<Cell>& cells, int apart, Real near_m, Visit visit) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (std::size_t j = i + 1; j < cells.size(); ++j) {
      const Cell &a = cells[i], &b = cells[j];
      if (b.low[0] > a.high[0] + near_m) break;
      if (std::abs(a.row - b.row) < apart && std::abs(a.col - b.col) < apart) continue;
      bool apart_in_space = false;
      for (int axis = 1; axis < 3; ++axis) {
        apart_in_space = apart_in_space || b.low[axis] > a.high[axis] + near_m ||
                         a.low[axis] > b.high[axis] + near_m;
      }
      if (!apart_in_space) visit(a, b);
    }
  }
}

bool passes_through(const std::vector<Point>& points, const std::array<int, 2>& edge,
                    const std::array<int, 3>& triangle) {
  const Point& p = points[triangle[0]];
  const Point u = minus(points[triangle[1]], p), v = minus(points[triangle[2]], p);
  const Point normal = cross(u, v);
  const Real before = dot(minus(points[edge[0]], p), normal);
  const Real after = dot(minus(points[edge[1]], p), normal);
  if (before * after >= 0) return false;
  const Real share = before / (before - after);
  Point w = minus(points[edge[1]], points[edge[0]]);
  for (int axis = 0; axis < 3; ++axis) w[axis] = points[edge[0]][axis] + share * w[axis] - p[axis];
  const Real area2 = dot(normal, normal);
  const Real s = dot(cross(w, v), normal) / area2, t = dot(cross(u, w), normal) / area2;
  return s >= 0 && t >= 0 && s + t <= 1;
}

class LayerCollector {
 public:
  LayerCollector(const std::vector<Point>& points, Real near_m)
      : points_(points), near_m_(near_m) {}

  void add(const std::array<int, 4>& particle, const std::array<Real, 4>& weight) {
    Point way{};
    for (int k = 0; k < 4; ++k) {
      for (int axis = 0; axis < 3; ++axis) way[axis] += weight[k] * points_[particle[k]][axis];
    }
    const Real size = std::sqrt(dot(way, way));
    if (size > near_m_ || !(size > 0)) return;
    for (Real& w : way) w /= size;
    found_.push_back({particle, weight, way, false});
  }

  void point_and_triangle(int i, const std::array<int, 3>& t) {
    const Point& p = points_[t[0]];
    const Point u = minus(points_[t[1]], p), v = minus(points_[t[2]], p);
    const Point w = minus(points_[i], p), normal = cross(u, v);
    const Real area2 = dot(normal, normal);
    if (!(area2 > 0)) return;
    const Real s = dot(cross(w, v), normal) / area2, r = dot(cross(u, w), normal) / area2;
    if (s >= 0 && r >= 0 && s + r <= 1) {
      add({i, t[0], t[1], t[2]}, {1, s + r - 1, -s, -r});
      return;
    }
    for (int k = 0; k < 3; ++k) {
      const Point edge = minus(points_[t[(k + 1) % 3]], points_[t[k]]);
      const Real share =
          std::clamp<Real>(dot(minus(points_[i], points_[t[k]]), edge) / dot(edge, edge), 0, 1);
      add({i, t[k], t[(k + 1) % 3], t[k]}, {1, share - 1, -share, 0});
    }
  }

  void edges(const std::array<int, 2>& one, const std::array<int, 2>& two) {
    const Point u = minus(points_[one[1]], points_[one[0]]);
    const Point v = minus(points_[two[1]], points_[two[0]]);
    const Point w = minus(points_[one[0]], points_[two[0]]);
    const Real uu = dot(u, u), vv = dot(v, v), uv = dot(u, v);
    const Real det = uu * vv - uv * uv;
    if (!(det > 1e-12L * uu * vv)) return;
    const Real s = (uv * dot(v, w) - vv * dot(u, w)) / det;
    const Real t = (uu * dot(v, w) - uv * dot(u, w)) / det;
    if (s > 0 && s < 1 && t > 0 && t < 1)
      add({one[0], one[1], two[0], two[1]}, {1 - s, s, t - 1, -t});
  }

  [[nodiscard]] std::vector<Support> take() { return std::move(found_); }

 private:
  const std::vector<Point>& points_;
  Real near_m_;
  std::vector<Support> found_;
};

}  // namespace

namespace {

bool are_within(int i, int j, int cols, int steps) {
  return std::abs(i / cols - j / cols) <= steps && std::abs(i % cols - j % cols) <= steps;
}

/// How many of the four particles are the first layer's: one and a triangle, or two edges, each
/// within one cell and the two no neighbours; 0 where they are neither, or the weights are not.
int firsts_of(const ContactForce& stated, std::size_t particles, int cols) {
  for (const int i : stated.particle) {
    if (static_cast<std::size_t>(i) >= particles) return 0;
  }
  const int firsts = are_within(stated.particle[0], stated.particle[1], cols, 1) ? 2 : 1;
  std::array<Real, 2> sum{};
  for (int k = 0; k < 4; ++k) {
    const Real weight = k < firsts ? stated.weight[k] : -stated.weight[k];
    if (weight < 0) return 0;
    sum[k < firsts ? 0 : 1] += weight;
    for (int l = 0; l < k; ++l) {
      const bool same = (k < firsts) == (l < firsts);
      if (are_within(stated.particle[k], stated.particle[l], cols, 1) != same) return 0;
    }
  }
  const bool whole =
      std::abs(sum[0] - 1) <= kWeightAllowed && std::abs(sum[1] - 1) <= kWeightAllowed;
  return whole ? firsts : 0;
}

}  // namespace

bool add_stated_layers(const std::vector<Point>& points, int cols, Real friction, Real near_m,
                       const ContactForce& stated, std::vector<Point>& sum) {
  const int firsts = firsts_of(stated, points.size(), cols);
  if (firsts == 0) return false;
  Point apart{}, force{};
  std::array<Point, 2> place{};  // on the first and on the second layer
  for (int k = 0; k < 4; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const Real part = stated.weight[k] * points[stated.particle[k]][axis];
      apart[axis] += part;
      place[k < firsts ? 0 : 1][axis] += k < firsts ? part : -part;
    }
  }
  for (int axis = 0; axis < 3; ++axis) force[axis] = stated.force_in_world[axis];
  const Real distance = std::sqrt(dot(apart, apart));
  if (!(distance > 0) || distance > near_m) return false;
  for (int k = 0; k < 4; ++k) {
    const bool first = k < firsts;
    const Point along = minus(points[stated.particle[k]], place[first ? 0 : 1]);
    const Real toward = (first ? 1 : -1) * dot(along, apart);
    if (toward < -kNearestAllowed * distance * std::sqrt(dot(along, along))) return false;
  }
  for (Real& a : apart) a /= distance;
  const Real pressing = std::max<Real>(0, dot(force, apart));
  Point across{};
  for (int axis = 0; axis < 3; ++axis) across[axis] = force[axis] - pressing * apart[axis];
  const Real size = std::sqrt(dot(across, across));
  const Real share = std::min<Real>(1, friction * pressing / std::max<Real>(size, 1e-300L));
  for (int k = 0; k < 4; ++k) {
    for (int axis = 0; axis < 3; ++axis)
      sum[stated.particle[k]][axis] +=
          stated.weight[k] * (pressing * apart[axis] + share * across[axis]);
  }
  return true;
}

int crossings_of(const std::vector<Point>& points, int rows, int cols) {
  int count = 0;
  visit_near(cells_of(points, rows, cols), 2, 0, [&](const Cell& a, const Cell& b) {
    for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)}) {
      for (const auto& edge : from->edge) {
        for (const auto& triangle : to->triangle) count += passes_through(points, edge, triangle);
      }
    }
  });
  return count;
}

std::vector<Support> layer_supports_of(const std::vector<Point>& points, int rows, int cols,
                                       Real near_m) {
  LayerCollector collector(points, near_m);
  visit_near(cells_of(points, rows, cols), 2, near_m, [&](const Cell& a, const Cell& b) {
    for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)}) {
      for (const int corner : from->corner) {
        for (const auto& triangle : to->triangle) collector.point_and_triangle(corner, triangle);
      }
    }
    for (const auto& one : a.edge) {
      for (const auto& two : b.edge) collector.edges(one, two);
    }
  });
  return collector.take();
}

}  // namespace drape::simulate::checker
