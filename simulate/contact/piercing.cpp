// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/piercing.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <vector>

#include "simulate/contact/box_tree.hpp"
#include "simulate/contact/deepest.hpp"
#include "simulate/contact/proximity.hpp"
#include "simulate/contact/solid_features.hpp"

namespace drape::simulate {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kInside = 1e-5;       // m; less is a line that lies on a body
constexpr int kDirections = 16;        // along a face, out of a body
constexpr double kShortestOut = 1e-5;  // m
constexpr int kHalvings = 30;

constexpr int kAround = 2;           // cells about one, in which the nearest place is sought
constexpr double kSamePlace = 1e-6;  // relative to an edge
constexpr int kPlaces = 4;           // on each side of an edge, whose heights are looked at

/// Particles of a cell's two triangles.
std::array<std::array<int, 3>, 2> corners_of(const GridSpec& grid, int cell) {
  const int below = cell + grid.cols;
  return {{{cell, cell + 1, below}, {cell + 1, below + 1, below}}};
}

/// Where an edge passes through a triangle, as a fraction of the edge.
std::optional<double> passes(const SolidEdge& edge, const std::array<Vector3d, 3>& t) {
  const Vector3d u = t[1] - t[0], v = t[2] - t[0], span = edge.b - edge.a;
  const Vector3d cross = u.cross(v);
  const double det = -span.dot(cross);
  if (det == 0) return std::nullopt;
  const Vector3d from = edge.a - t[0];
  const double fraction = from.dot(cross) / det;
  const double s = -span.cross(from).dot(v) / det;
  const double r = span.cross(from).dot(u) / det;
  const bool inside = fraction > 0 && fraction < 1 && s >= 0 && r >= 0 && s + r <= 1;
  return inside ? std::optional(fraction) : std::nullopt;
}

/// True if the piece of a grid line between two particles, or the particle where they are one, is
/// of the sheet's hem.
bool is_hem(const GridSpec& grid, int i, int j) {
  const int row = std::min(i, j) / grid.cols, col = std::min(i, j) % grid.cols;
  if (i == j) return grid.cells_at(row, col) < 4;
  if (std::abs(i - j) == 1) return !(grid.has_cell(row - 1, col) && grid.has_cell(row, col));
  if (std::abs(i - j) == grid.cols)
    return !(grid.has_cell(row, col - 1) && grid.has_cell(row, col));
  return false;  // a cell's diagonal
}

/// Distance of a point from the cells about one; 0 for a point beyond the hem, whose nearest place
/// is on it.
double over_sheet_m(const GridSpec& grid, const Field& position, int cell, const Vector3d& p) {
  const int row = cell / grid.cols, col = cell % grid.cols;
  double least = std::numeric_limits<double>::infinity();
  bool beyond = false;
  for (int r = std::max(0, row - kAround); r <= std::min(grid.rows - 2, row + kAround); ++r) {
    for (int c = std::max(0, col - kAround); c <= std::min(grid.cols - 2, col + kAround); ++c) {
      if (!grid.has_cell(r, c)) continue;
      for (const auto& corner : corners_of(grid, grid.index(r, c))) {
        const Nearest nearest = point_to_triangle(p, at(position, corner[0]),
                                                  at(position, corner[1]), at(position, corner[2]));
        if (!(nearest.apart.norm() < least)) continue;
        least = nearest.apart.norm();
        std::vector<int> ends;
        for (int k = 0; k < 3; ++k) {
          if (nearest.weight[k + 1] != 0) ends.push_back(corner[k]);
        }
        beyond = ends.size() < 3 && is_hem(grid, ends.front(), ends.back());
      }
    }
  }
  return beyond ? 0 : least;
}

/// Where an edge passes through the sheet.
struct Passage {
  double fraction = 0;  ///< place along the edge
  int cell = 0;
};

/// Reach of the shorter side of an edge, of at most `most_m` each, from the
/// sheet before it passes through it again. Its height above the plane of the triangle that it
/// passes through would say nothing: at a small angle a long edge ends over other cells.
double height_through(const GridSpec& grid, const Field& position, const SolidEdge& edge,
                      const Passage& here, const Passage* before, const Passage* after,
                      double most_m) {
  const Vector3d span = edge.b - edge.a;
  const double reach = most_m / span.norm();
  const double back = before != nullptr ? before->fraction : 0.0;
  const double on = after != nullptr ? after->fraction : 1.0;
  double least = most_m;
  for (const double end :
       {std::max(back, here.fraction - reach), std::min(on, here.fraction + reach)}) {
    double side = 0;
    for (int k = 1; k <= kPlaces; ++k) {
      const double fraction = here.fraction + (end - here.fraction) * k / kPlaces;
      side = std::max(side, over_sheet_m(grid, position, here.cell, edge.a + fraction * span));
    }
    least = std::min(least, side);
  }
  return least;
}

/// From a place in a body at right angles to `normal`, the shortest of some distances out of it.
double distance_out_m(const Surroundings& surroundings, int shape, const Vector3d& p,
                      const Vector3d& normal, double most_m) {
  const Vector3d across = normal.unitOrthogonal();
  double least = most_m;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 2 * std::numbers::pi * k / kDirections;
    const Vector3d direction = Eigen::AngleAxisd(angle, normal) * across;
    const auto is_in = [&](double far) {
      return surroundings.gap_m(shape, p + far * direction) < 0;
    };
    double inside = 0, outside = kShortestOut;
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
  return distance_out_m(surroundings, shape, 0.5 * (entry + exit),
                        surroundings.normal(shape, entry), length);
}

Vector3d extents_of(const PlacedMesh& body) {
  const std::vector<Vector3d>& corners = body.mesh->corners();
  Eigen::MatrixX3d places(corners.size(), 3);
  for (Eigen::Index k = 0; k < places.rows(); ++k)
    places.row(k) = corners[static_cast<std::size_t>(k)].transpose();
  places.rowwise() -= places.colwise().mean().eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(places.transpose() * places);
  const Eigen::MatrixX3d along = places * axes.eigenvectors();
  return (along.colwise().maxCoeff() - along.colwise().minCoeff()).transpose();
}

/// Extents (m) along the edges or principal axes, the least first. Of a ball none: it is as wide as
/// thick.
Vector3d extents_of(const Surroundings& surroundings, int shape) {
  Vector3d sizes = Vector3d::Zero();
  if (const auto* box = surroundings.box(shape)) sizes = box->size_m;
  if (const auto* body = surroundings.cylinder(shape))
    sizes = {2 * body->radius_m, 2 * body->radius_m, body->height_m};
  if (const auto* mesh = surroundings.mesh(shape)) sizes = extents_of(*mesh);
  std::sort(sizes.begin(), sizes.end());
  return sizes;
}

/// Thickness of a convex body at a place in it. Normals are those about the place, since the body's
/// middle has none.
double thickness_at(const Surroundings& surroundings, int shape, const Vector3d& p) {
  const auto out = [&](const Vector3d& direction) {
    double far = 2 * kInside;
    while (surroundings.gap_m(shape, p + far * direction) < 0) far *= 2;
    double near = 0;
    for (int halving = 0; halving < kHalvings; ++halving) {
      const double middle = 0.5 * (near + far);
      (surroundings.gap_m(shape, p + middle * direction) < 0 ? near : far) = middle;
    }
    return far;
  };
  double least = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-kInside, kInside}) {
      const Vector3d normal = surroundings.normal(shape, p + side * Vector3d::Unit(axis));
      least = std::min(least, out(normal) + out(-normal));
    }
  }
  return least;
}

}  // namespace

double through_part(const GridSpec& grid, const Field& position, const Surroundings& surroundings) {
  double largest = 0;
  for (int shape = 0; shape < surroundings.count(); ++shape) {
    if (surroundings.is_flat(shape)) continue;
    const bool mesh = surroundings.mesh(shape) != nullptr;
    const Vector3d extents_m = extents_of(surroundings, shape);
    for (int cell = 0; cell < grid.count(); ++cell) {
      if (!grid.has_cell(cell / grid.cols, cell % grid.cols)) continue;
      for (const auto& [a, b, c] : corners_of(grid, cell)) {
        const SheetTriangle piece = {at(position, a), at(position, b), at(position, c)};
        const double reach_m = std::max((piece[1] - piece[0]).norm(), (piece[2] - piece[0]).norm());
        // A wider body meets grid lines: rim_through_m() or its own depth shows it.
        if (extents_m[1] > reach_m || surroundings.gap_m(shape, piece[0]) > reach_m) continue;
        const DeepestPlace deepest = deepest_place(surroundings, shape, piece);
        if (!(deepest.gap_m < 0)) continue;
        const Vector3d place = deepest.weights[0] * piece[0] + deepest.weights[1] * piece[1] +
                               deepest.weights[2] * piece[2];
        const double thickness_m = mesh ? extents_m[0] : thickness_at(surroundings, shape, place);
        largest = std::max(largest, -deepest.gap_m / thickness_m);
      }
    }
  }
  return largest;
}

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
  std::map<int, std::vector<Passage>> passages;  // by edge
  for (int cell = 0; cell < grid.count(); ++cell) {
    if (!grid.has_cell(cell / grid.cols, cell % grid.cols)) continue;
    AlignedBox3d box(at(position, cell), at(position, cell));
    for (const int i : {cell + 1, cell + grid.cols, cell + grid.cols + 1})
      box.extend(at(position, i));
    tree.query(box, [&](int edge) {
      for (const auto& [a, b, c] : corners_of(grid, cell)) {
        if (const auto fraction =
                passes(edges[edge], {at(position, a), at(position, b), at(position, c)}))
          passages[edge].push_back({*fraction, cell});
      }
    });
  }
  double largest = 0;
  for (auto& [edge, list] : passages) {
    std::sort(list.begin(), list.end(),
              [](const Passage& p, const Passage& q) { return p.fraction < q.fraction; });
    // Where two triangles meet both are passed through.
    list.erase(std::unique(list.begin(), list.end(),
                           [](const Passage& p, const Passage& q) {
                             return q.fraction - p.fraction < kSamePlace;
                           }),
               list.end());
    for (std::size_t k = 0; k < list.size(); ++k)
      largest =
          std::max(largest, height_through(grid, position, edges[edge], list[k],
                                           k > 0 ? &list[k - 1] : nullptr,
                                           k + 1 < list.size() ? &list[k + 1] : nullptr, most_m));
  }
  return largest;
}

}  // namespace drape::simulate
