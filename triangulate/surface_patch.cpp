// SPDX-License-Identifier: Apache-2.0
#include "triangulate/surface_patch.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace drape::triangulate {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector3d;

/// Typical curvature of folds in draped cloth, for use where it is unknown.
constexpr double kUnknownPerM = 40;
constexpr std::size_t kLeastLines = 20;  // determines an RMS to within a sixth
constexpr double kUnknownTiltRad = 0.3;  // tilt of a mark without a normal from its ellipses

/// Offset of one neighbour from the tangent plane. Lengths are measured along the cloth.
struct Arm {
  Vector3d direction;         ///< unit tangent at the mark, towards the neighbour
  double length_m = 0;        ///< arc length along the cloth
  double height_m = 0;        ///< height of the neighbour above the tangent plane
  double slope = 0;           ///< sine of the angle between neighbour's normal and tangent plane's
  Vector3d normal;            ///< unit normal of the neighbour
  double sigma_rad = 0;       ///< standard deviation of that normal
  double sigma_here_rad = 0;  ///< standard deviation of the mark's own normal

  /// Larger of the curvatures that height and slope imply for a circle.
  [[nodiscard]] double strongest_bend_per_m() const {
    return std::max(std::abs(2 * height_m / length_m), std::abs(slope)) / length_m;
  }
};

/// `printed_m` is the distance to the neighbour on the print.
std::optional<Arm> arm_to(const MarksOnSurface& marks, MarkId neighbour, const MarkOnSurface& from,
                          double printed_m) {
  const auto other = marks.find(neighbour);
  if (!from.normal || other == marks.end() || !other->second.normal) return std::nullopt;
  const Vector3d& normal = from.normal->normal;
  const Vector3d chord = other->second.in_world - from.in_world;
  Arm arm;
  arm.height_m = chord.dot(normal);
  arm.direction = (chord - arm.height_m * normal).normalized();
  // Cloth hardly stretches, so its length equals that on the print.
  arm.length_m = std::max(printed_m, chord.norm());
  arm.normal = other->second.normal->normal;
  arm.sigma_rad = other->second.normal->sigma_rad;
  arm.sigma_here_rad = from.normal->sigma_rad;
  arm.slope = normal.cross(arm.direction).cross(arm.normal).normalized().dot(normal);
  return arm.direction.allFinite() ? std::optional(arm) : std::nullopt;
}

/// Second derivative of the height along the cloth at the mark, and its standard deviation due to
/// the noise of the normals.
struct Bend {
  double per_m = 0;
  double sigma_per_m = 0;
  double strongest_per_m = 0;  ///< largest curvature seen towards a neighbour
};

/// Fits a cubic with zero height and slope at the mark to height and slope at the neighbour.
Bend bend_of(const Arm& arm) {
  const double h = arm.length_m;
  return {6 * arm.height_m / (h * h) - 2 * arm.slope / h,
          std::hypot(4 * arm.sigma_here_rad, 2 * arm.sigma_rad) / h, arm.strongest_bend_per_m()};
}

/// Fits a quintic to heights and slopes of both neighbours (exact up to fifth order).
Bend bend_of(const Arm& ahead, const Arm& behind) {
  const double h = (ahead.length_m + behind.length_m) / 2;
  return {2 * (ahead.height_m + behind.height_m) / (h * h) - (ahead.slope + behind.slope) / (2 * h),
          std::hypot(ahead.sigma_rad, behind.sigma_rad) / (2 * h),
          std::max(ahead.strongest_bend_per_m(), behind.strongest_bend_per_m())};
}

struct Line {
  Vector3d tangent;
  Bend bend;
  Vector3d normal_change_per_m;
};

std::optional<Line> line_through(const std::optional<Arm>& ahead, const std::optional<Arm>& behind,
                                 const Vector3d& normal) {
  if (ahead && behind) {
    const Vector3d tangent = (ahead->direction - behind->direction).normalized();
    return Line{tangent, bend_of(*ahead, *behind),
                (ahead->normal - behind->normal) / (ahead->length_m + behind->length_m)};
  }
  if (ahead) {
    return Line{ahead->direction, bend_of(*ahead), (ahead->normal - normal) / ahead->length_m};
  }
  if (behind) {
    return Line{-behind->direction, bend_of(*behind), (normal - behind->normal) / behind->length_m};
  }
  return std::nullopt;
}

/// Curvature along a lattice line through a mark, from the marks `steps` pitches away on either
/// side.
std::optional<Bend> bend_along(const MarksOnSurface& marks, MarkId mark, MarkId line, int steps,
                               double pitch_m) {
  const MarkOnSurface& from = marks.at(mark);
  const MarkId offset{steps * line.row, steps * line.col};
  const double length_m = steps * pitch_m;
  const auto ahead = arm_to(marks, {mark.row + offset.row, mark.col + offset.col}, from, length_m);
  const auto behind = arm_to(marks, {mark.row - offset.row, mark.col - offset.col}, from, length_m);
  if (!ahead || !behind) return std::nullopt;
  return bend_of(*ahead, *behind);
}

}  // namespace

CurvatureTrust curvature_trust(const MarksOnSurface& marks, double pitch_m) {
  struct Bend {
    double strongest_per_m, change_per_m;
  };
  std::vector<Bend> changes;
  for (const auto& [mark, surface] : marks) {
    for (const MarkId line : {MarkId{1, 0}, MarkId{0, 1}}) {
      const auto near = bend_along(marks, mark, line, 1, pitch_m);
      const auto far = bend_along(marks, mark, line, 2, pitch_m);
      if (near && far) changes.push_back({far->strongest_per_m, near->per_m - far->per_m});
    }
  }
  CurvatureTrust trust;
  const std::size_t half = changes.size() / 2;
  if (half < kLeastLines) return trust;
  std::sort(changes.begin(), changes.end(),
            [](const Bend& a, const Bend& b) { return a.strongest_per_m < b.strongest_per_m; });
  double sum = 0;
  for (std::size_t i = 0; i < half; ++i) sum += changes[i].change_per_m * changes[i].change_per_m;
  trust.least_per_m = std::sqrt(sum / static_cast<double>(half));
  trust.lines = static_cast<int>(half);
  return trust;
}

Vector3d SurfacePatch::curvature_variance(const CurvatureTrust& trust) const {
  const double least = trust.least_per_m * trust.least_per_m;
  return noise_per_m.cwiseAbs2() + least * Vector3d(1, 0.5, 1) +
         trust.fraction * trust.fraction * strongest_per_m.cwiseAbs2();
}

SurfacePatch surface_patch(const MarksOnSurface& marks, MarkId mark, double pitch_m,
                           const Vector3d& to_cameras) {
  const MarkOnSurface& centre = marks.at(mark);
  const Vector3d normal = centre.normal ? centre.normal->normal : to_cameras;
  const auto arm = [&](int row, int col) {
    return arm_to(marks, {mark.row + row, mark.col + col}, centre, pitch_m);
  };
  auto warp = line_through(arm(1, 0), arm(-1, 0), normal);
  auto weft = line_through(arm(0, 1), arm(0, -1), normal);
  const auto unknown = [&](const Vector3d& tangent) {
    return Line{tangent, {0, kUnknownPerM, 0}, Vector3d::Zero()};
  };
  if (!warp) warp = unknown(weft ? Vector3d(weft->tangent.cross(normal)) : normal.unitOrthogonal());
  if (!weft) weft = unknown(normal.cross(warp->tangent));
  SurfacePatch patch;
  patch.axis_u = warp->tangent;
  patch.axis_v = normal.cross(patch.axis_u);
  // Second fundamental form along warp, weft and mixed, rotated to the axes (u, v).
  const double mixed = -(warp->normal_change_per_m.dot(weft->tangent) +
                         weft->normal_change_per_m.dot(warp->tangent)) /
                       2;
  Matrix2d along;
  along << warp->bend.per_m, mixed, mixed, weft->bend.per_m;
  Matrix2d tangents;  // columns: warp and weft in (u, v)
  tangents << 1, weft->tangent.dot(patch.axis_u), 0, weft->tangent.dot(patch.axis_v);
  const Matrix2d inverse = tangents.inverse();
  patch.curvature_per_m = -(inverse.transpose() * along * inverse);
  const auto three = [](double of_warp, double of_weft) {
    return Vector3d(of_warp, std::sqrt(of_warp * of_weft / 2), of_weft);
  };
  patch.noise_per_m = three(warp->bend.sigma_per_m, weft->bend.sigma_per_m);
  patch.strongest_per_m = three(warp->bend.strongest_per_m, weft->bend.strongest_per_m);
  patch.normal_sigma_rad = centre.normal ? centre.normal->sigma_rad : kUnknownTiltRad;
  if (!patch.curvature_per_m.allFinite()) patch.curvature_per_m.setZero();
  return patch;
}

}  // namespace drape::triangulate
