// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/piercing.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "simulate/contact/box_tree.hpp"
#include "simulate/contact/solid_features.hpp"

namespace drape::simulate {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kInside = 1e-5;       // m; less is a line that lies on a body
constexpr int kDirections = 16;        // along a face, out of a body
constexpr double kShortestWay = 1e-5;  // m
constexpr int kHalvings = 30;

/// Height of the lower end of the edge above the triangle that it passes through, else 0.
double height_through(const SolidEdge& edge, const std::array<Vector3d, 3>& t, double most_m) {
  const Vector3d u = t[1] - t[0], v = t[2] - t[0], way = edge.b - edge.a;
  const Vector3d cross = u.cross(v);
  const double det = -way.dot(cross);
  if (det == 0) return 0;
  const Vector3d from = edge.a - t[0];
  const double share = from.dot(cross) / det;
  const double s = -way.cross(from).dot(v) / det;
  const double r = way.cross(from).dot(u) / det;
  if (!(share > 0 && share < 1 && s >= 0 && r >= 0 && s + r <= 1)) return 0;
  const double length = way.norm();
  const double shorter = std::min({share * length, (1 - share) * length, most_m});
  return shorter * std::abs(way.dot(cross)) / (length * cross.norm());
}

/// From a place in a body at right angles to `normal`, the shortest of some distances out of it.
double way_out_m(const Surroundings& surroundings, int shape, const Vector3d& p,
                 const Vector3d& normal, double most_m) {
  const Vector3d across = normal.unitOrthogonal();
  double least = most_m;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 2 * std::numbers::pi * k / kDirections;
    const Vector3d way = Eigen::AngleAxisd(angle, normal) * across;
    const auto is_in = [&](double far) { return surroundings.gap_m(shape, p + far * way) < 0; };
    double inside = 0, outside = kShortestWay;
    for (; outside < least && is_in(outside); outside *= 2) inside = outside;
    if (outside >= least && is_in(least)) continue;
    outside = std::min(outside, least);
    for (int halving = 0; halving < kHalvings; ++halving) {
      const double middle = 0.5 * (inside + outside);
      (is_in(middle) ? inside : outside) = middle;
    }
    least = outside;
  }
  return least;
}

/// The same of a piece of a grid line; 0 where it does not pass through the body.
double rim_over_m(const Surroundings& surroundings, int shape, const Vector3d& a,
                  const Vector3d& b) {
  const double length = (b - a).norm();
  const double gap = surroundings.gap_m(shape, a);
  if (gap > length || gap < -kInside || surroundings.gap_m(shape, b) < -kInside) return 0;
  const auto in = surroundings.first_entry(shape, a, b, kInside);
  const auto back = surroundings.first_entry(shape, b, a, kInside);
  if (!in || !back) return 0;
  const Vector3d entry = a + *in * (b - a), exit = b + *back * (a - b);
  if (!surroundings.on_opposite_sides(shape, entry, exit)) return 0;
  return way_out_m(surroundings, shape, 0.5 * (entry + exit), surroundings.normal(shape, entry),
                   length);
}

}  // namespace

double rim_through_m(const GridSpec& grid, const Field& position,
                     const Surroundings& surroundings) {
  double largest = 0;
  for (int shape = 0; shape < surroundings.count(); ++shape) {
    if (surroundings.is_flat(shape)) continue;
    for (int i = 0; i < grid.count(); ++i) {
      const int row = i / grid.cols, col = i % grid.cols;
      const bool right = grid.has_cell(row, col) || grid.has_cell(row - 1, col);
      const bool down = grid.has_cell(row, col) || grid.has_cell(row, col - 1);
      for (const int next : {right ? i + 1 : i, down ? i + grid.cols : i}) {
        if (next == i) continue;
        largest =
            std::max(largest, rim_over_m(surroundings, shape, at(position, i), at(position, next)));
      }
    }
  }
  return largest;
}

double pierced_m(const GridSpec& grid, const Field& position, const Surroundings& surroundings) {
  const std::vector<SolidEdge> edges = features_of(surroundings).edges;
  if (edges.empty()) return 0;
  std::vector<Vector3d> centres;
  std::vector<AlignedBox3d> boxes;
  for (const SolidEdge& edge : edges) {
    centres.push_back(0.5 * (edge.a + edge.b));
    boxes.push_back(AlignedBox3d(edge.a, edge.a).extend(edge.b));
  }
  BoxTree tree(centres);
  tree.refit(boxes);
  const double most_m = std::max(grid.warp_spacing_m(), grid.weft_spacing_m());
  double largest = 0;
  for (int cell = 0; cell < grid.count(); ++cell) {
    if (!grid.has_cell(cell / grid.cols, cell % grid.cols)) continue;
    const Vector3d a = at(position, cell), b = at(position, cell + 1);
    const Vector3d c = at(position, cell + grid.cols), d = at(position, cell + grid.cols + 1);
    const std::array<std::array<Vector3d, 3>, 2> triangles{{{a, b, c}, {b, d, c}}};
    AlignedBox3d box(a, a);
    box.extend(b).extend(c).extend(d);
    tree.query(box, [&](int edge) {
      for (const auto& triangle : triangles)
        largest = std::max(largest, height_through(edges[edge], triangle, most_m));
    });
  }
  return largest;
}

}  // namespace drape::simulate
