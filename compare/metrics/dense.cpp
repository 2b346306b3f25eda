// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/dense.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace drape::compare {
namespace {

/// Accumulates the samples of one direction.
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

/// Centroids of the n^2 equal parts of a triangle.
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

NearestSurface::NearestSurface(const TriangleMesh& mesh) {
  if (mesh.triangles.empty())
    throw bad_input("a surface without a triangle has no distance", {},
                    "give a sheet with at least one complete cell");
  std::vector<TriangleTree::Corners> triangles;
  for (const auto& [a, b, c] : mesh.triangles)
    triangles.push_back({mesh.points[a], mesh.points[b], mesh.points[c]});
  tree_ = TriangleTree(triangles);
}

Eigen::Vector3d NearestSurface::nearest(const Eigen::Vector3d& point) const {
  return tree_.nearest(point).point;
}

double NearestSurface::distance_m(const Eigen::Vector3d& point) const {
  return (nearest(point) - point).norm();
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
