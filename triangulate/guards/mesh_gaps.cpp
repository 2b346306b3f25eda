// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/mesh_gaps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/files/mesh_file.hpp"
#include "core/parallel.hpp"
#include "core/statistics/distributions.hpp"
#include "core/units.hpp"
#include "triangulate/guards/object_fit.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Vector3d;
using units::mm;

/// A triangle's corners seen from a mark.
struct Seen {
  Vector3d a, b, c;

  /// Of the part of the edge from `from` to `to` that is nearest to the mark.
  static double to_edge(const Vector3d& from, const Vector3d& to) {
    const Vector3d edge = to - from;
    const double length2 = edge.squaredNorm();
    const double at = length2 > 0 ? std::clamp(-from.dot(edge) / length2, 0.0, 1.0) : 0;
    return (from + at * edge).norm();
  }

  [[nodiscard]] double distance() const {
    const Vector3d normal = (b - a).cross(c - a);
    const auto is_left_of = [&](const Vector3d& from, const Vector3d& to) {
      return normal.dot(from.cross(to)) >= 0;
    };
    const double length = normal.norm();
    if (length > 0 && is_left_of(a, b) && is_left_of(b, c) && is_left_of(c, a))
      return std::abs(normal.dot(a)) / length;
    return std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
  }

  [[nodiscard]] double solid_angle() const {
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    return 2 * std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
};

double gap_m(const MeshFile& mesh, const Vector3d& mark_m) {
  double nearest = std::numeric_limits<double>::infinity(), angle = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto from_mark = [&](const MeshCorner& corner) -> Vector3d {
      return mesh.points[corner.point] * mm - mark_m;
    };
    const Seen seen{from_mark(a), from_mark(b), from_mark(c)};
    nearest = std::min(nearest, seen.distance());
    angle += seen.solid_angle();
  }
  return std::abs(angle) > 2 * std::numbers::pi ? -nearest : nearest;
}

}  // namespace

std::vector<double> gaps_to_mesh(const Sheet& sheet, const MeshObject& object, int threads) {
  const MeshFile mesh = read_mesh_file(object.file);
  const auto mesh_from_world = object.world_from_mesh.inverse();
  std::vector<double> gaps(sheet.marks.size());
  parallel_for(gaps.size(), threads, [&](std::size_t i) {
    gaps[i] = gap_m(mesh, mesh_from_world * sheet.marks[i].point_in_world);
  });
  return gaps;
}

double most_inside_m(const ObjectUncertainty& stated, const SheetMark& mark) {
  return std::sqrt(chi_square_beyond(kObjectRisk, 4)) *
             std::hypot(stated.place_m(), stated.size_m()) +
         kObjectSigmas * std::hypot(sigma_m(mark), kCrease_m);
}

std::string contradiction_of_mesh(const Sheet& sheet, const std::vector<double>& gaps,
                                  const MeshObject& object, const ObjectUncertainty& stated) {
  int inside = 0;
  std::size_t deepest = 0;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    inside += -gaps[i] > most_inside_m(stated, sheet.marks[i]);
    if (gaps[i] < gaps[deepest]) deepest = i;
  }
  if (inside == 0) return {};
  const SheetMark& mark = sheet.marks[deepest];
  return fmt::format(
      "{} mark{} deep inside {}, ({}, {}) by {:.2f} mm, and where place ({:.2f} mm) and size "
      "({:.2f} mm) are as uncertain as stated no mark lies deeper than {:.2f}; compare the file's "
      "unit and size, origin_mm and yaw_deg with the object, or measure it with a plate of tags "
      "(drape object)",
      inside, inside == 1 ? " lies" : "s lie", object.file.string(), mark.mark.row, mark.mark.col,
      -gaps[deepest] / mm, stated.place_m() / mm, stated.size_m() / mm,
      most_inside_m(stated, mark) / mm);
}

}  // namespace drape::triangulate
