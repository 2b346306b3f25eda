// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/surface.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

constexpr double kEdgeTolerance_m = 1e-9;
constexpr double kLatticeTolerance_m = 1e-6;

/// Sets, or checks, the common coordinate of all marks of a row (or column).
void agree(std::optional<double>& slot, double value, const SheetMark& mark, const char* axis,
           const std::string& file) {
  if (slot && std::abs(*slot - value) > kLatticeTolerance_m) {
    throw bad_input(
        fmt::format("the {} coordinate of mark ({}, {}) is {} mm, of its neighbours {} mm", axis,
                    mark.mark.row, mark.mark.col, value / units::mm, *slot / units::mm),
        {.file = file, .field = "material_mm"},
        "give a sheet whose points form a rectangular grid in material coordinates");
  }
  if (!slot) slot = value;
}

std::vector<double> complete(const std::vector<std::optional<double>>& slots, const char* axis,
                             const std::string& file) {
  std::vector<double> values;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (!slots[i] || (i > 0 && *slots[i] <= values.back())) {
      throw bad_input(fmt::format("line {} along the {} has no point, or its material coordinate "
                                  "does not grow",
                                  i, axis),
                      {.file = file, .field = "material_mm"},
                      "give a simulated sheet without empty rows or columns");
    }
    values.push_back(*slots[i]);
  }
  return values;
}

/// Index of the cell that contains `x`, and the position within it, 0..1.
std::optional<std::pair<std::size_t, double>> cell_of(const std::vector<double>& lines, double x) {
  if (x < lines.front() - kEdgeTolerance_m || x > lines.back() + kEdgeTolerance_m)
    return std::nullopt;
  const auto after = std::upper_bound(lines.begin() + 1, lines.end() - 1, x);
  const auto cell = static_cast<std::size_t>(after - lines.begin()) - 1;
  const double t = (x - lines[cell]) / (lines[cell + 1] - lines[cell]);
  return std::pair{cell, std::clamp(t, 0.0, 1.0)};
}

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

Surface::Surface(const Sheet& sheet, const std::string& file) {
  if (sheet.rows < 2 || sheet.cols < 2) {
    throw bad_input(fmt::format("a sheet of {}x{} points has no surface", sheet.rows, sheet.cols),
                    {.file = file}, "simulate with at least 2 particles per side");
  }
  const auto rows = static_cast<std::size_t>(sheet.rows);
  const auto cols = static_cast<std::size_t>(sheet.cols);
  std::vector<std::optional<double>> warp(rows), weft(cols);
  points_.resize(rows * cols);
  for (const SheetMark& mark : sheet.marks) {
    const auto row = static_cast<std::size_t>(mark.mark.row);
    const auto col = static_cast<std::size_t>(mark.mark.col);
    agree(warp[row], mark.material_m.x(), mark, "warp", file);
    agree(weft[col], mark.material_m.y(), mark, "weft", file);
    points_[row * cols + col] = mark.point_in_world;
  }
  warp_m_ = complete(warp, "warp", file);
  weft_m_ = complete(weft, "weft", file);
}

const std::optional<Eigen::Vector3d>& Surface::point(std::size_t row, std::size_t col) const {
  return points_[row * weft_m_.size() + col];
}

std::optional<SurfacePoint> Surface::at(const Eigen::Vector2d& material_m) const {
  const auto warp = cell_of(warp_m_, material_m.x());
  const auto weft = cell_of(weft_m_, material_m.y());
  if (!warp || !weft) return std::nullopt;
  const auto [row, s] = *warp;
  const auto [col, t] = *weft;
  const auto &p00 = point(row, col), &p01 = point(row, col + 1);
  const auto &p10 = point(row + 1, col), &p11 = point(row + 1, col + 1);
  if (!p00 || !p01 || !p10 || !p11) return std::nullopt;
  const Eigen::Vector3d warp_tangent = (1 - t) * (*p10 - *p00) + t * (*p11 - *p01);
  const Eigen::Vector3d weft_tangent = (1 - s) * (*p01 - *p00) + s * (*p11 - *p10);
  const Eigen::Vector3d normal = warp_tangent.cross(weft_tangent);
  if (!(normal.norm() > 0)) return std::nullopt;
  const Eigen::Vector3d point_in_world = (1 - s) * ((1 - t) * *p00 + t * *p01) +  //
                                         s * ((1 - t) * *p10 + t * *p11);
  return SurfacePoint{point_in_world, warp_tangent.normalized(), weft_tangent.normalized(),
                      normal.normalized()};
}

std::optional<LatticeCoordinates> LatticeCoordinates::of(const Sheet& sheet,
                                                         const std::string& file) {
  if (sheet.marks.empty()) return std::nullopt;
  const SheetMark& first = sheet.marks.front();
  const SheetMark *other_row = nullptr, *other_col = nullptr;
  for (const SheetMark& mark : sheet.marks) {
    if (mark.mark.row != first.mark.row) other_row = &mark;
    if (mark.mark.col != first.mark.col) other_col = &mark;
  }
  if (other_row == nullptr || other_col == nullptr) return std::nullopt;
  LatticeCoordinates lattice;
  lattice.pitch_m_ = {
      (other_row->material_m.x() - first.material_m.x()) / (other_row->mark.row - first.mark.row),
      (other_col->material_m.y() - first.material_m.y()) / (other_col->mark.col - first.mark.col)};
  lattice.origin_m_ = first.material_m - lattice.pitch_m_.cwiseProduct(
                                             Eigen::Vector2d(first.mark.row, first.mark.col));
  for (const SheetMark& mark : sheet.marks) {
    if ((lattice.at(mark.mark) - mark.material_m).norm() > kLatticeTolerance_m) {
      throw bad_input(fmt::format("mark ({}, {}) is not on the regular lattice of the others",
                                  mark.mark.row, mark.mark.col),
                      {.file = file, .field = "material_mm"},
                      "check pitch and margin in the print file and triangulate again");
    }
  }
  return lattice;
}

Eigen::Vector2d LatticeCoordinates::at(MarkId mark) const {
  return origin_m_ + pitch_m_.cwiseProduct(Eigen::Vector2d(mark.row, mark.col));
}

double area_m2(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d& p = mesh.points[a];
    area += 0.5 * (mesh.points[b] - p).cross(mesh.points[c] - p).norm();
  }
  return area;
}

NearestSurface::NearestSurface(const TriangleMesh& mesh) {
  if (mesh.triangles.empty())
    throw bad_input("a surface without a triangle has no distance", {},
                    "give a sheet with at least one complete cell");
  std::vector<TriangleTree::Corners> triangles;
  for (const auto& [a, b, c] : mesh.triangles)
    triangles.push_back({mesh.points[a], mesh.points[b], mesh.points[c]});
  tree_ = TriangleTree(triangles);
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

SurfaceDistance surface_distance(const TriangleMesh& first, const TriangleMesh& second,
                                 double spacing_m) {
  if (!(spacing_m > 0)) throw usage_error("the spacing of samples must be above 0 mm", "");
  const NearestSurface to_first(first), to_second(second);
  return {one_direction(first, to_second, spacing_m), one_direction(second, to_first, spacing_m)};
}

}  // namespace drape::compare
