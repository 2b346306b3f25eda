// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/dense.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"

namespace drape::compare {
namespace {

constexpr std::size_t kLeaf = 6;  ///< triangles that are not worth another box

using Box3 = Eigen::AlignedBox3d;

struct Node {
  Box3 box;
  std::size_t begin = 0, end = 0;  ///< triangles of a leaf
  std::size_t left = 0, right = 0;
  [[nodiscard]] bool is_leaf() const { return right == 0; }
};

/// Gathers the samples of one direction.
struct Gathered {
  double area = 0, sum = 0, squares = 0, largest = 0;

  void add(double weight, double distance) {
    area += weight;
    sum += weight * distance;
    squares += weight * distance * distance;
    largest = std::max(largest, distance);
  }
  [[nodiscard]] OneDirection finish() const {
    return {sum / area, std::sqrt(squares / area), largest};
  }
};

/// Centroids of the n^2 equal triangles of one triangle.
template <class Visit>
void visit_pieces(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                  int n, const Visit& visit) {
  const auto at = [&](double u, double v) -> Eigen::Vector3d {
    return a + u / n * (b - a) + v / n * (c - a);
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      visit(at(i + 1.0 / 3, j + 1.0 / 3));
      if (i + j + 1 < n) visit(at(i + 2.0 / 3, j + 2.0 / 3));
    }
  }
}

OneDirection one_direction(const TriangleMesh& from, const NearestSurface& to, double spacing_m) {
  Gathered gathered;
  for (const auto& [i, j, k] : from.triangles) {
    const Eigen::Vector3d &a = from.points[i], &b = from.points[j], &c = from.points[k];
    const double area = 0.5 * (b - a).cross(c - a).norm();
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int n = std::max(1, static_cast<int>(std::ceil(longest / spacing_m * (1 - 1e-9))));
    visit_pieces(a, b, c, n, [&](const Eigen::Vector3d& point) {
      gathered.add(area / (n * n), to.distance_m(point));
    });
    for (const auto* corner : {&a, &b, &c}) gathered.add(0, to.distance_m(*corner));
  }
  return gathered.finish();
}

}  // namespace

struct NearestSurface::Tree {
  TriangleMesh mesh;
  std::vector<Node> nodes;

  [[nodiscard]] Eigen::Vector3d middle(const std::array<std::size_t, 3>& t) const {
    return (mesh.points[t[0]] + mesh.points[t[1]] + mesh.points[t[2]]) / 3;
  }

  // The recursion is as deep as the logarithm of the number of triangles.
  std::size_t build(std::size_t begin, std::size_t end) {  // NOLINT(misc-no-recursion)
    const std::size_t index = nodes.size();
    nodes.push_back({});
    Box3 box;
    for (std::size_t i = begin; i < end; ++i)
      for (const std::size_t corner : mesh.triangles[i]) box.extend(mesh.points[corner]);
    nodes[index].box = box;
    nodes[index].begin = begin;
    nodes[index].end = end;
    if (end - begin <= kLeaf) return index;
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const auto first = mesh.triangles.begin();
    const std::size_t half = begin + (end - begin) / 2;
    std::nth_element(
        first + static_cast<std::ptrdiff_t>(begin), first + static_cast<std::ptrdiff_t>(half),
        first + static_cast<std::ptrdiff_t>(end),
        [&](const auto& a, const auto& b) { return middle(a)[axis] < middle(b)[axis]; });
    const std::size_t left = build(begin, half);
    const std::size_t right = build(half, end);
    nodes[index].left = left;
    nodes[index].right = right;
    return index;
  }

  void search(std::size_t index, const Eigen::Vector3d& point,  // NOLINT(misc-no-recursion)
              double& best, Eigen::Vector3d& place) const {
    const Node& node = nodes[index];
    if (node.is_leaf()) {
      for (std::size_t i = node.begin; i < node.end; ++i) {
        const auto& [a, b, c] = mesh.triangles[i];
        const Eigen::Vector3d nearest =
            nearest_on_triangle(point, mesh.points[a], mesh.points[b], mesh.points[c]);
        const double squared = (nearest - point).squaredNorm();
        if (squared >= best) continue;
        best = squared;
        place = nearest;
      }
      return;
    }
    const double to_left = nodes[node.left].box.squaredExteriorDistance(point);
    const double to_right = nodes[node.right].box.squaredExteriorDistance(point);
    const bool left_first = to_left <= to_right;
    if (std::min(to_left, to_right) < best)
      search(left_first ? node.left : node.right, point, best, place);
    if (std::max(to_left, to_right) < best)
      search(left_first ? node.right : node.left, point, best, place);
  }
};

NearestSurface::NearestSurface(const TriangleMesh& mesh) : tree_(std::make_unique<Tree>()) {
  if (mesh.triangles.empty())
    throw bad_input("a surface without a triangle has no distance", {},
                    "give a sheet with at least one complete cell");
  tree_->mesh = mesh;
  tree_->build(0, mesh.triangles.size());
}

NearestSurface::~NearestSurface() = default;

Eigen::Vector3d NearestSurface::nearest(const Eigen::Vector3d& point) const {
  double best = std::numeric_limits<double>::max();
  Eigen::Vector3d place = point;
  tree_->search(0, point, best, place);
  return place;
}

double NearestSurface::distance_m(const Eigen::Vector3d& point) const {
  return (nearest(point) - point).norm();
}

Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = point - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Eigen::Vector3d bp = point - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return d1 == d3 ? a : a + d1 / (d1 - d3) * ab;
  const Eigen::Vector3d cp = point - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return d2 == d6 ? a : a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double along = (d4 - d3) + (d5 - d6);
    return along > 0 ? b + (d4 - d3) / along * (c - b) : b;
  }
  const double whole = va + vb + vc;
  return a + vb / whole * ab + vc / whole * ac;
}

TriangleMesh mesh_of(const Sheet& sheet) {
  TriangleMesh mesh;
  const auto cols = static_cast<std::size_t>(sheet.cols);
  std::vector<std::optional<std::size_t>> index(static_cast<std::size_t>(sheet.rows) * cols);
  for (const SheetMark& mark : sheet.marks) {
    index[static_cast<std::size_t>(mark.mark.row) * cols +
          static_cast<std::size_t>(mark.mark.col)] = mesh.points.size();
    mesh.points.push_back(mark.point_in_world);
  }
  for (std::size_t i = 0; i + cols < index.size(); ++i) {
    if (i % cols + 1 == cols) continue;
    const auto &a = index[i], &b = index[i + cols], &c = index[i + cols + 1], &d = index[i + 1];
    if (!a || !b || !c || !d) continue;
    mesh.triangles.push_back({*a, *b, *c});
    mesh.triangles.push_back({*a, *c, *d});
  }
  return mesh;
}

double SurfaceDistance::mean_m() const {
  return 0.5 * (first_to_second.mean_m + second_to_first.mean_m);
}

double SurfaceDistance::hausdorff_m() const {
  return std::max(first_to_second.hausdorff_m, second_to_first.hausdorff_m);
}

SurfaceDistance surface_distance(const TriangleMesh& first, const TriangleMesh& second,
                                 double spacing_m) {
  if (!(spacing_m > 0)) throw usage_error("the spacing of samples must be above 0 mm", "");
  const NearestSurface to_first(first), to_second(second);
  return {one_direction(first, to_second, spacing_m), one_direction(second, to_first, spacing_m)};
}

}  // namespace drape::compare
