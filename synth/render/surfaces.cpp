// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.hpp"
#include "core/geometry/body.hpp"
#include "core/units.hpp"
#include "synth/render/render.hpp"

namespace drape::synth {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Cell of a face point, and position within it.
struct InCell {
  int row, col;
  double y, x;  ///< 0..1
};

std::optional<InCell> cell_of(const GridSurface& surface, const FacePoint& face) {
  constexpr double slack = 1e-9;
  const Vector2d at = (face - surface.first).cwiseQuotient(surface.step);
  if (at.minCoeff() < -slack || at.x() > surface.cols - 1 + slack ||
      at.y() > surface.rows - 1 + slack) {
    return std::nullopt;
  }
  InCell cell{};
  cell.col = std::clamp(static_cast<int>(at.x()), 0, surface.cols - 2);
  cell.row = std::clamp(static_cast<int>(at.y()), 0, surface.rows - 2);
  cell.x = at.x() - cell.col;
  cell.y = at.y() - cell.row;
  return cell;
}

/// Arc length of A sin(k x + phase) from 0, tabulated for inversion.
class ArcLength {
 public:
  ArcLength(const Folds& folds, double reach_m) {
    const double k = 2 * std::numbers::pi / folds.wavelength_m;
    const double slope = std::tan(folds.slope_rad);
    const auto speed = [&](double x) {
      return std::hypot(1.0, slope * std::cos(k * x + folds.phase_rad));
    };
    const int steps = 4000;
    h_ = reach_m / steps;
    for (const double side : {-1.0, 1.0}) {
      std::vector<double>& table = side < 0 ? left_ : right_;
      table.push_back(0);
      for (int i = 0; i < steps; ++i) {
        const double x = side * i * h_;  // Simpson's rule over one step
        table.push_back(table.back() +
                        h_ / 6 * (speed(x) + 4 * speed(x + side * h_ / 2) + speed(x + side * h_)));
      }
    }
  }
  /// x at a given arc length, by linear interpolation in steps of at most 0.01 mm.
  [[nodiscard]] double x_at(double s) const {
    const std::vector<double>& table = s < 0 ? left_ : right_;
    const double length = std::abs(s);
    const auto above = std::upper_bound(table.begin() + 1, table.end() - 1, length);
    const auto i = static_cast<double>(above - table.begin() - 1);
    const double fraction = (length - *(above - 1)) / (*above - *(above - 1));
    return std::copysign((i + fraction) * h_, s);
  }

 private:
  double h_ = 0;
  std::vector<double> left_, right_;
};

double cubic(double a, double b, double c, double d, double t) {
  return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
}

/// Extrapolates a grid row or column linearly beyond its ends.
Vector3d continued(const GridSurface& s, int row, int col) {
  const int r = std::clamp(row, 0, s.rows - 1), c = std::clamp(col, 0, s.cols - 1);
  Vector3d point = s.at(r, c);
  if (r != row) point += s.at(r, c) - s.at(r == 0 ? 1 : r - 1, c);
  if (c != col) point += s.at(r, c) - s.at(r, c == 0 ? 1 : c - 1);
  return point;
}

Vector3d interpolated(const GridSurface& s, const FacePoint& face) {
  const InCell cell = *cell_of(s, face);
  Vector3d result;
  for (int axis = 0; axis < 3; ++axis) {
    double across[4];
    for (int i = 0; i < 4; ++i) {
      double along[4];
      for (int j = 0; j < 4; ++j) {
        along[j] = continued(s, cell.row - 1 + i, cell.col - 1 + j)[axis];
      }
      across[i] = cubic(along[0], along[1], along[2], along[3], cell.x);
    }
    result[axis] = cubic(across[0], across[1], across[2], across[3], cell.y);
  }
  return result;
}

using units::mm;

constexpr double object_reflectance = 0.5;
constexpr double table_reflectance = 0.3;

// A sharp corner shrunk by this many edge radii relative to its faces touches the rounded corner: 1
// - 1 / sqrt(3).
constexpr double corner_fraction = 0.423;

void draw_in(Sphere& sphere, double by_m) {
  sphere.radius_m = std::max(0.0, sphere.radius_m - by_m);
}

void draw_in(Box& box, double by_m) {
  const double in_m = by_m + corner_fraction * box.edge_radius_m;
  box.size_m = (box.size_m.array() - 2 * in_m).max(0.0);
}

void draw_in(Cylinder& cylinder, double by_m) {
  const double in_m = by_m + corner_fraction * cylinder.edge_radius_m;
  cylinder.radius_m = std::max(0.0, cylinder.radius_m - in_m);
  cylinder.height_m = std::max(0.0, cylinder.height_m - 2 * in_m);
}

void draw_in(Plane& plane, double by_m) {
  plane.point_in_world -= by_m * plane.normal_in_world;
}

void draw_in(MeshObject&, double) {}

void add(const Obstacle& object, double reflectance, std::vector<Triangle>& all) {
  if (const auto* mesh = std::get_if<MeshObject>(&object))
    throw bad_input("a mesh among the scene's objects cannot be rendered",
                    {.file = mesh->file.string()},
                    "put spheres, boxes or cylinders in its place, or render the set's folds, "
                    "which lie on the table alone, without --sheet");
  for (const SurfaceQuad& c : drape::surface_of(object, 96, 1000 * mm))
    for (const auto& [i, j, k] : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
      Triangle t;
      t.corners_in_world = {c[i].point, c[j].point, c[k].point};
      t.normals_in_world = {c[i].normal, c[j].normal, c[k].normal};
      t.reflectance = reflectance;
      all.push_back(t);
    }
}

}  // namespace

void fields(Fields& f, Folds& folds) {
  f.otherwise({"slope_deg", "steepest slope of the folds", units::deg, 0, 80}, folds.slope_rad);
  f.otherwise({"wavelength_mm", "distance between two crests of the folds", units::mm, 5},
              folds.wavelength_m);
}

std::optional<Vector3d> GridSurface::point_in_world(const FacePoint& face) const {
  const auto cell = cell_of(*this, face);
  if (!cell) return std::nullopt;
  const auto [row, col, y, x] = *cell;
  if (x + y <= 1) {
    return at(row, col) + x * (at(row, col + 1) - at(row, col)) +
           y * (at(row + 1, col) - at(row, col));
  }
  const Vector3d& corner = at(row + 1, col + 1);
  return corner + (1 - x) * (at(row + 1, col) - corner) + (1 - y) * (at(row, col + 1) - corner);
}

Vector3d GridSurface::vertex_normal(int row, int col) const {
  const Vector3d along_x = at(row, std::min(col + 1, cols - 1)) - at(row, std::max(col - 1, 0));
  const Vector3d along_y = at(std::min(row + 1, rows - 1), col) - at(std::max(row - 1, 0), col);
  return along_y.cross(along_x).normalized();
}

Vector3d GridSurface::normal_in_world(const FacePoint& face) const {
  const auto cell = cell_of(*this, face);
  if (!cell) return Vector3d::UnitZ();
  const auto [row, col, y, x] = *cell;
  return ((1 - y) * ((1 - x) * vertex_normal(row, col) + x * vertex_normal(row, col + 1)) +
          y * ((1 - x) * vertex_normal(row + 1, col) + x * vertex_normal(row + 1, col + 1)))
      .normalized();
}

GridSurface surface_of(const FacePoint& least, const FacePoint& most, double step_m,
                       const std::function<Vector3d(const FacePoint&)>& place) {
  GridSurface surface;
  const Vector2d cells = ((most - least) / step_m).array().round().max(1).matrix();
  surface.cols = static_cast<int>(cells.x()) + 1;
  surface.rows = static_cast<int>(cells.y()) + 1;
  surface.first = least;
  surface.step = (most - least).cwiseQuotient(cells);
  for (int row = 0; row < surface.rows; ++row) {
    for (int col = 0; col < surface.cols; ++col) {
      surface.points_in_world.push_back(
          place(least + surface.step.cwiseProduct(Vector2d(col, row))));
    }
  }
  return surface;
}

GridSurface folded(const Print& print, const Folds& folds, double step_m) {
  const FacePoint most(print.patch_m.y(), print.patch_m.x());
  const FacePoint middle = most / 2;
  const ArcLength arc(folds, most.norm());
  const double k = 2 * std::numbers::pi / folds.wavelength_m;
  const double amplitude = std::tan(folds.slope_rad) / k;
  const Vector2d along(std::cos(folds.direction_rad), std::sin(folds.direction_rad));
  const Vector2d across(-along.y(), along.x());
  const Eigen::Matrix3d world_from_sheet =
      Eigen::AngleAxisd(folds.yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
  return surface_of(FacePoint::Zero(), most, step_m, [&](const FacePoint& face) {
    const Vector2d from_middle = face - middle;
    const double x = arc.x_at(along.dot(from_middle));
    const Vector2d flat = x * along + across.dot(from_middle) * across;
    // y of the face runs down the page, so it is -y in a world seen from above.
    const Vector3d in_sheet(flat.x(), -flat.y(), amplitude * std::sin(k * x + folds.phase_rad));
    return Vector3d(folds.centre_in_world + world_from_sheet * in_sheet);
  });
}

GridSurface surface_of(const Sheet& sheet, double step_m) {
  if (!sheet.gaps.empty() || static_cast<int>(sheet.marks.size()) != sheet.rows * sheet.cols ||
      sheet.rows < 2 || sheet.cols < 2) {
    throw bad_input(fmt::format("the sheet has {} of {} x {} points; a surface needs all of them",
                                sheet.marks.size(), sheet.rows, sheet.cols),
                    {}, "give a simulated sheet, or a measured one without gaps");
  }
  const auto face = [](const SheetMark& m) {
    return FacePoint(m.material_m.y(), m.material_m.x());
  };
  GridSurface coarse;
  coarse.rows = sheet.rows;
  coarse.cols = sheet.cols;
  coarse.first = face(sheet.marks.front());
  coarse.step = (face(sheet.marks.back()) - coarse.first)
                    .cwiseQuotient(Vector2d(sheet.cols - 1, sheet.rows - 1));
  for (const SheetMark& mark : sheet.marks) {
    const FacePoint expected =
        coarse.first + coarse.step.cwiseProduct(Vector2d(mark.mark.col, mark.mark.row));
    if ((expected - face(mark)).norm() > 1e-6) {
      throw bad_input(
          fmt::format("point ({}, {}) is not on an even grid", mark.mark.row, mark.mark.col), {},
          "give a sheet whose points are evenly spaced on the cloth");
    }
    coarse.points_in_world.push_back(mark.point_in_world);
  }
  return surface_of(coarse.first, face(sheet.marks.back()), step_m,
                    [&](const FacePoint& at) { return interpolated(coarse, at); });
}

GridSurface surface_of(const Target& target, const WorldFromTarget& pose) {
  const double border = target.pitch_m;
  const FacePoint first = face_point(target, {target.rows - 1, 0});
  const FacePoint last = face_point(target, {0, target.cols - 1});
  return surface_of(first - FacePoint::Constant(border), last + FacePoint::Constant(border),
                    target.pitch_m / 4,
                    [&](const FacePoint& face) { return pose * Vector3d(face.x(), -face.y(), 0); });
}

std::vector<Triangle> table_triangles(double z_m) {
  std::vector<Triangle> all;
  add(Plane{Vector3d(0, 0, z_m), Vector3d::UnitZ()}, table_reflectance, all);
  return all;
}

Scene drawn_in(Scene scene, double by_m) {
  scene.table_z_m -= by_m;
  for (Obstacle& obstacle : scene.obstacles)
    std::visit([&](auto& object) { draw_in(object, by_m); }, obstacle);
  return scene;
}

std::vector<Triangle> triangles_of(const Scene& scene) {
  std::vector<Triangle> all = table_triangles(scene.table_z_m);
  for (const Obstacle& obstacle : scene.obstacles) add(obstacle, object_reflectance, all);
  return all;
}

}  // namespace drape::synth
