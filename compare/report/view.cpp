// SPDX-License-Identifier: Apache-2.0
#include "compare/report/view.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "compare/meshes/obstacle_mesh.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kMostCells = 40;             ///< a side; finer sheets are drawn by every k-th row
constexpr double kFar_m = 1000;            ///< to the eye of an orthographic view
constexpr double kObjectBehind_m = 0.003;  ///< cloth that touches is drawn over the object

}  // namespace

std::vector<std::array<Vector3d, 4>> drawn_cells(const Sheet& sheet) {
  const int step = std::max(1, std::max(sheet.rows, sheet.cols) / kMostCells);
  std::vector<std::array<Vector3d, 4>> cells;
  for (int row = 0; row + 1 < sheet.rows; row += step) {
    for (int col = 0; col + 1 < sheet.cols; col += step) {
      const int below = std::min(row + step, sheet.rows - 1);
      const int right = std::min(col + step, sheet.cols - 1);
      const SheetMark *a = sheet.find({row, col}), *b = sheet.find({below, col}),
                      *c = sheet.find({below, right}), *d = sheet.find({row, right});
      if (a && b && c && d)
        cells.push_back(
            {a->point_in_world, b->point_in_world, c->point_in_world, d->point_in_world});
    }
  }
  return cells;
}

Orthographic Orthographic::from(double azimuth_rad, double elevation_rad) {
  const double ca = std::cos(azimuth_rad), sa = std::sin(azimuth_rad);
  const double ce = std::cos(elevation_rad), se = std::sin(elevation_rad);
  const Vector3d toward(ca * ce, sa * ce, se), right(-sa, ca, 0);
  return {right, toward.cross(right), toward};
}

double Orthographic::fit(const std::vector<Vector3d>& points, double left, double side,
                         double margin) {
  Eigen::AlignedBox2d box;
  for (const Vector3d& point : points) box.extend(Vector2d(right.dot(point), -up.dot(point)));
  scale = (side - 2 * margin) / std::max(box.sizes().maxCoeff(), 1e-9);
  const double height = scale * box.sizes().y() + 2 * margin;
  origin = Vector2d(left + side / 2, height / 2) - scale * box.center();
  return height;
}

Vector2d Orthographic::at(const Vector3d& point) const {
  return origin + scale * Vector2d(right.dot(point), -up.dot(point));
}

Viewer Orthographic::viewer() const {
  return {[*this](const Vector3d& point) { return at(point); }, kFar_m * toward};
}

void Painter::add(const Vector3d& point, double nearer_m, std::function<void(Svg&)> draw) {
  items_.push_back({(viewer_.eye_in_world - point).norm() - nearer_m, std::move(draw)});
}

void Painter::add_face(const std::array<Vector3d, 4>& corners, const Vector3d& rgb,
                       bool two_sided) {
  std::vector<Vector2d> places;
  for (const Vector3d& corner : corners) {
    const auto place = viewer_.place(corner);
    if (!place) return;
    places.push_back(*place);
  }
  const Vector3d middle = (corners[0] + corners[1] + corners[2] + corners[3]) / 4;
  const Vector3d toward = (viewer_.eye_in_world - middle).normalized();
  const Vector3d normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalized();
  const double side = normal.dot(toward) > 0 ? 1 : -1;
  if (side < 0 && !two_sided) return;
  const Vector3d light = (toward + Vector3d(0.3, -0.2, 0.6)).normalized();
  const double shade = 0.45 + 0.55 * std::max(0.0, side * normal.dot(light));
  const std::string fill = hex_colour((side > 0 ? shade : 0.82 * shade) * rgb);
  add(middle, two_sided ? 0 : -kObjectBehind_m, [places, fill](Svg& svg) {
    svg.polygon(places, fmt::format("fill=\"{0}\" stroke=\"{0}\"", fill));
  });
}

void Painter::add_cloth(const Sheet& cloth) {
  for (const auto& cell : drawn_cells(cloth)) add_face(cell, {232, 234, 238}, true);
}

void Painter::add_objects(const Scene& scene, const Sheet& cloth) {
  for (const auto& quad : uncovered_quads(scene, cloth)) add_face(quad, {195, 162, 115}, false);
}

void Painter::paint(Svg& svg) {
  std::stable_sort(items_.begin(), items_.end(),
                   [](const Item& a, const Item& b) { return a.distance_m > b.distance_m; });
  svg.open_group("stroke-width=\"0.5\" stroke-linejoin=\"round\"");
  for (const Item& item : items_) item.draw(svg);
  svg.close_group();
}

}  // namespace drape::compare
