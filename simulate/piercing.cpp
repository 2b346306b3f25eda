// SPDX-License-Identifier: Apache-2.0
#include "simulate/piercing.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "simulate/box_tree.hpp"
#include "simulate/solid_features.hpp"

namespace drape::sim {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

Vector3d at(const Field& x, int i) {
  const std::size_t n = x.size() / 3;
  return {x[i], x[n + i], x[2 * n + i]};
}

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

}  // namespace

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

}  // namespace drape::sim
