// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/taut.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/pose.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Vector3d;

/// Length of a string around a circle of radius r between two points at distances a and b from its
/// centre, which subtend the angle phi on the string's side; nullopt if it does not touch.
std::optional<double> around_circle(double a, double b, double phi, double r) {
  a = std::max(a, r);
  b = std::max(b, r);
  const double free = std::acos(a > 0 ? r / a : 1) + std::acos(b > 0 ? r / b : 1);
  if (phi <= free) return std::nullopt;
  return std::sqrt(a * a - r * r) + std::sqrt(b * b - r * r) + r * (phi - free);
}

/// Path over one edge of a box centred on the origin. The rounded edge is a cylinder; unrolled, the
/// path is straight. nullopt if the string does not touch the edge, or near its ends, where a path
/// around the corner may be shorter.
std::optional<double> over_edge(const Vector3d& from, const Vector3d& to, const Vector3d& half_m,
                                double radius_m, int axis, const Eigen::Vector2d& out) {
  const int j = (axis + 1) % 3, k = (axis + 2) % 3;
  const Eigen::Vector2d edge =
      out.cwiseProduct(Eigen::Vector2d(half_m[j], half_m[k])) - radius_m * out;
  const auto across = [&](const Vector3d& at) {
    return Eigen::Vector2d(out.cwiseProduct(Eigen::Vector2d(at[j], at[k]) - edge));
  };
  // In the plane across the edge the object fills the negative quadrant, enlarged by the radius.
  const Eigen::Vector2d a = across(from), b = across(to);
  const auto turn = [](const Eigen::Vector2d& u) {
    return std::atan2(u.y() - u.x(), u.x() + u.y());
  };
  const bool outside = a.maxCoeff() >= 0 && b.maxCoeff() >= 0;
  if (!outside || turn(a) * turn(b) >= 0) return std::nullopt;
  const auto flat_m =
      around_circle(a.norm(), b.norm(), std::abs(turn(a)) + std::abs(turn(b)), radius_m);
  if (!flat_m) return std::nullopt;
  const double length_m = std::hypot(*flat_m, to[axis] - from[axis]);
  const double beside_m = half_m[axis] - std::max(std::abs(from[axis]), std::abs(to[axis]));
  const double chord_m = (to - from).norm();
  // Largest distance from the chord of a path of this length.
  const double bulge_m = 0.5 * std::sqrt(std::max(0.0, length_m * length_m - chord_m * chord_m));
  return beside_m >= bulge_m ? std::optional(length_m) : std::nullopt;
}

struct Taut {
  Vector3d from, to;

  double operator()(const Sphere& body) const {
    const Vector3d a = from - body.centre_in_world, b = to - body.centre_in_world;
    const double phi = std::atan2(a.cross(b).norm(), a.dot(b));
    return around_circle(a.norm(), b.norm(), phi, body.radius_m).value_or((to - from).norm());
  }
  double operator()(const Box& body) const {
    const double chord_m = (to - from).norm();
    const Vector3d half_m = 0.5 * body.size_m;
    const WorldFromObject& pose = body.world_from_box;
    // Points farther away than from each other cannot reach an edge.
    const double reach_m = half_m.norm() + chord_m;
    if ((from - pose.translation_m).squaredNorm() > reach_m * reach_m) return chord_m;
    const Vector3d a = pose.inverse() * from, b = pose.inverse() * to;
    std::optional<double> shortest_m;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double x : {1.0, -1.0}) {
        for (const double y : {1.0, -1.0}) {
          const auto found_m = over_edge(a, b, half_m, body.edge_radius_m, axis, {x, y});
          if (found_m) shortest_m = std::min(*found_m, shortest_m.value_or(*found_m));
        }
      }
    }
    return shortest_m.value_or(chord_m);
  }
  template <class Body>
  double operator()(const Body&) const {
    return (to - from).norm();
  }
};

}  // namespace

double sigma_m(const SheetMark& mark) {
  return mark.covariance_m2 ? std::sqrt(mark.covariance_m2->trace()) : 0;
}

std::vector<ClothSpan> spans_of(const Sheet& sheet, double most_strain) {
  std::vector<ClothSpan> spans;
  for (const SheetMark& mark : sheet.marks) {
    for (const MarkId next :
         {MarkId{mark.mark.row + 1, mark.mark.col}, MarkId{mark.mark.row, mark.mark.col + 1}}) {
      const SheetMark* to = sheet.find(next);
      if (to == nullptr) continue;
      spans.push_back({&mark, to, (to->material_m - mark.material_m).norm() * (1 + most_strain),
                       std::hypot(sigma_m(mark), sigma_m(*to))});
    }
  }
  return spans;
}

double taut_path_m(const Obstacle& object, const Vector3d& from, const Vector3d& to) {
  return std::visit(Taut{from, to}, object);
}

double shortfall_m(const Obstacle& object, const ClothSpan& span) {
  const Vector3d &from = span.from->point_in_world, &to = span.to->point_in_world;
  const double chord_m = (to - from).norm();
  return std::max(0.0, taut_path_m(object, from, to) - std::max(span.cloth_m, chord_m));
}

}  // namespace drape::triangulate
