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

/// Calls visit(a, b) for cells whose boxes come within `near_m`.
template <class Visit>
void visit_near(const std::vector<Cell>& cells, Real near_m, Visit visit) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (std::size_t j = i + 1; j < cells.size(); ++j) {
      const Cell &a = cells[i], &b = cells[j];
      if (b.low[0] > a.high[0] + near_m) break;
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
  const Real fraction = before / (before - after);
  Point w = minus(points[edge[1]], points[edge[0]]);
  for (int axis = 0; axis < 3; ++axis)
    w[axis] = points[edge[0]][axis] + fraction * w[axis] - p[axis];
  const Real area2 = dot(normal, normal);
  const Real s = dot(cross(w, v), normal) / area2, t = dot(cross(u, w), normal) / area2;
  return s >= 0 && t >= 0 && s + t <= 1;
}

bool are_within(int i, int j, int cols, int steps) {
  return std::abs(i / cols - j / cols) <= steps && std::abs(i % cols - j % cols) <= steps;
}

/// True if all four particles lie in one cell.
bool are_in_one_cell(const std::array<int, 4>& particle, int cols) {
  for (const int i : particle) {
    for (const int j : particle) {
      if (!are_within(i, j, cols, 1)) return false;
    }
  }
  return true;
}

/// Distance at which two pieces, the first one of `firsts` particles, may press; nothing where they
/// are no two layers.
Real reach_of(const std::array<int, 4>& particle, int firsts, int cols, const LayerReach& reach) {
  if (are_in_one_cell(particle, cols)) return 0;
  Real least = reach.layers_m;
  for (int k = 0; k < firsts; ++k) {
    for (int l = firsts; l < 4; ++l) {
      if (particle[k] == particle[l]) return 0;
      if (are_within(particle[k], particle[l], cols, 1))
        least = std::min(least, reach.neighbours_m);
    }
  }
  return least;
}

class LayerCollector {
 public:
  LayerCollector(const std::vector<Point>& points, int cols, const LayerReach& reach)
      : points_(points), cols_(cols), reach_(reach) {}

  void point_and_triangle(int i, const std::array<int, 3>& t) {
    const Real near_m = reach_of({i, t[0], t[1], t[2]}, 1, cols_, reach_);
    if (!(near_m > 0)) return;
    const Point& p = points_[t[0]];
    const Point u = minus(points_[t[1]], p), v = minus(points_[t[2]], p);
    const Point w = minus(points_[i], p), normal = cross(u, v);
    const Real area2 = dot(normal, normal);
    if (!(area2 > 0)) return;
    const Real s = dot(cross(w, v), normal) / area2, r = dot(cross(u, w), normal) / area2;
    if (s >= 0 && r >= 0 && s + r <= 1) {
      add({i, t[0], t[1], t[2]}, {1, s + r - 1, -s, -r}, near_m);
      return;
    }
    for (int k = 0; k < 3; ++k) {
      const Point edge = minus(points_[t[(k + 1) % 3]], points_[t[k]]);
      const Real fraction =
          std::clamp<Real>(dot(minus(points_[i], points_[t[k]]), edge) / dot(edge, edge), 0, 1);
      add({i, t[k], t[(k + 1) % 3], t[k]}, {1, fraction - 1, -fraction, 0}, near_m);
    }
  }

  void edges(const std::array<int, 2>& one, const std::array<int, 2>& two) {
    const Real near_m = reach_of({one[0], one[1], two[0], two[1]}, 2, cols_, reach_);
    if (!(near_m > 0)) return;
    const Point u = minus(points_[one[1]], points_[one[0]]);
    const Point v = minus(points_[two[1]], points_[two[0]]);
    const Point w = minus(points_[one[0]], points_[two[0]]);
    const Real uu = dot(u, u), vv = dot(v, v), uv = dot(u, v);
    const Real det = uu * vv - uv * uv;
    if (!(det > 1e-12L * uu * vv)) return;
    const Real s = (uv * dot(v, w) - vv * dot(u, w)) / det;
    const Real t = (uu * dot(v, w) - uv * dot(u, w)) / det;
    if (s > 0 && s < 1 && t > 0 && t < 1)
      add({one[0], one[1], two[0], two[1]}, {1 - s, s, t - 1, -t}, near_m);
  }

  [[nodiscard]] std::vector<Support> take() { return std::move(found_); }

 private:
  void add(const std::array<int, 4>& particle, const std::array<Real, 4>& weight, Real near_m) {
    Point displacement{};
    for (int k = 0; k < 4; ++k) {
      for (int axis = 0; axis < 3; ++axis)
        displacement[axis] += weight[k] * points_[particle[k]][axis];
    }
    const Real size = std::sqrt(dot(displacement, displacement));
    if (size > near_m || !(size > 0)) return;
    for (Real& w : displacement) w /= size;
    found_.push_back({particle, weight, displacement, false});
  }

  const std::vector<Point>& points_;
  int cols_;
  LayerReach reach_;
  std::vector<Support> found_;
};

/// True if the four particles are a first piece of `firsts` and a second one, each within one cell,
/// and the weights are those of a place on either.
bool are_pieces(const ContactForce& stated, int firsts, int cols) {
  if (!are_layer_weights(stated.weight, firsts)) return false;
  for (int k = 0; k < 4; ++k) {
    for (int l = 0; l < k; ++l) {
      const bool same = (k < firsts) == (l < firsts);
      if (same && !are_within(stated.particle[k], stated.particle[l], cols, 1)) return false;
    }
  }
  return true;
}

/// The same as add_stated_layers(), of a first piece of `firsts` particles.
bool add_as(const std::vector<Point>& points, int firsts, int cols, Real friction,
            const LayerReach& reach, const ContactForce& stated, std::vector<Point>& sum) {
  if (!are_pieces(stated, firsts, cols)) return false;
  std::array<Point, 4> corner{};
  for (int k = 0; k < 4; ++k) corner[k] = points[stated.particle[k]];
  const auto force =
      layer_force(corner, stated.weight, firsts, friction,
                  reach_of(stated.particle, firsts, cols, reach), stated.force_in_world);
  if (!force) return false;
  for (int k = 0; k < 4; ++k) {
    for (int axis = 0; axis < 3; ++axis)
      sum[stated.particle[k]][axis] += stated.weight[k] * (*force)[axis];
  }
  return true;
}

}  // namespace

bool are_layer_weights(const std::array<double, 4>& weight, int firsts) {
  std::array<Real, 2> sum{};
  for (int k = 0; k < 4; ++k) {
    const Real of = k < firsts ? weight[k] : -weight[k];
    if (!(of >= 0)) return false;
    sum[k < firsts ? 0 : 1] += of;
  }
  return std::abs(sum[0] - 1) <= kWeightAllowed && std::abs(sum[1] - 1) <= kWeightAllowed;
}

std::optional<Point> layer_force(const std::array<Point, 4>& corner,
                                 const std::array<double, 4>& weight, int firsts, Real friction,
                                 Real near_m, const Eigen::Vector3d& force_in_world) {
  Point apart{}, force{};
  std::array<Point, 2> place{};  // on the first and on the second layer
  for (int k = 0; k < 4; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const Real part = weight[k] * corner[k][axis];
      apart[axis] += part;
      place[k < firsts ? 0 : 1][axis] += k < firsts ? part : -part;
    }
  }
  for (int axis = 0; axis < 3; ++axis) force[axis] = force_in_world[axis];
  const Real distance = std::sqrt(dot(apart, apart));
  if (!(distance > 0) || distance > near_m) return std::nullopt;
  for (int k = 0; k < 4; ++k) {
    const bool first = k < firsts;
    const Point along = minus(corner[k], place[first ? 0 : 1]);
    const Real toward = (first ? 1 : -1) * dot(along, apart);
    if (toward < -kNearestAllowed * distance * std::sqrt(dot(along, along))) return std::nullopt;
  }
  for (Real& a : apart) a /= distance;
  const Real pressing = std::max<Real>(0, dot(force, apart));
  Point across{};
  for (int axis = 0; axis < 3; ++axis) across[axis] = force[axis] - pressing * apart[axis];
  const Real size = std::sqrt(dot(across, across));
  const Real fraction = std::min<Real>(1, friction * pressing / std::max<Real>(size, 1e-300L));
  Point left{};
  for (int axis = 0; axis < 3; ++axis)
    left[axis] = pressing * apart[axis] + fraction * across[axis];
  return left;
}

bool add_stated_layers(const std::vector<Point>& points, int cols, Real friction,
                       const LayerReach& reach, const ContactForce& stated,
                       std::vector<Point>& sum) {
  for (const int i : stated.particle) {
    if (i < 0 || static_cast<std::size_t>(i) >= points.size()) return false;
  }
  // Neighbours may be read in both directions where a weight is 0.
  return add_as(points, 2, cols, friction, reach, stated, sum) ||
         add_as(points, 1, cols, friction, reach, stated, sum);
}

int crossings_of(const std::vector<Point>& points, int rows, int cols) {
  int count = 0;
  visit_near(cells_of(points, rows, cols), 0, [&](const Cell& a, const Cell& b) {
    for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)}) {
      for (const auto& edge : from->edge) {
        for (const auto& triangle : to->triangle) {
          const bool meet = std::any_of(triangle.begin(), triangle.end(), [&](int corner) {
            return corner == edge[0] || corner == edge[1];
          });
          count += !meet && passes_through(points, edge, triangle);
        }
      }
    }
  });
  return count;
}

std::vector<Support> layer_supports_of(const std::vector<Point>& points, int rows, int cols,
                                       const LayerReach& reach) {
  LayerCollector collector(points, cols, reach);
  visit_near(cells_of(points, rows, cols), reach.layers_m, [&](const Cell& a, const Cell& b) {
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
