// SPDX-License-Identifier: Apache-2.0
#include "triangulate/dot_shape.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/dot_image.hpp"

namespace drape {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector3d;

/// Curvature of a fold that nothing is known about, and the least error of a known one: both as
/// seen on draped cloth, where folds of 25 mm radius are common and 200 mm is flat.
constexpr double kUnknownPerM = 40;
constexpr double kLeastSigmaPerM = 5;

/// How the cloth leaves the tangent plane on the way to one neighbour. Lengths along the cloth.
struct Arm {
  Vector3d direction;    ///< unit tangent at the mark towards the neighbour
  double length_m = 0;   ///< along the cloth
  double height_m = 0;   ///< of the neighbour over the tangent plane
  double slope = 0;      ///< of the cloth there against the tangent plane (sine), from its normal
  Vector3d normal;       ///< of the neighbour
  double sigma_rad = 0;  ///< of that normal
  double sigma_here_rad = 0;  ///< of the mark's own
};

std::optional<Arm> arm_to(const MarksOnSurface& marks, MarkId neighbour, const MarkOnSurface& from,
                          double pitch_m) {
  const auto other = marks.find(neighbour);
  if (other == marks.end() || !other->second.normal) return std::nullopt;
  const Vector3d& normal = from.normal->normal;
  const Vector3d way = other->second.in_world - from.in_world;
  Arm arm;
  arm.height_m = way.dot(normal);
  arm.direction = (way - arm.height_m * normal).normalized();
  // Cloth hardly stretches, so the way along it is the pitch of the print.
  arm.length_m = std::max(pitch_m, way.norm());
  arm.normal = other->second.normal->normal;
  arm.sigma_rad = other->second.normal->sigma_rad;
  arm.sigma_here_rad = from.normal->sigma_rad;
  arm.slope = normal.cross(arm.direction).cross(arm.normal).normalized().dot(normal);
  return arm.direction.allFinite() ? std::optional(arm) : std::nullopt;
}

/// Second derivative of the height along the cloth at the mark, with an estimate of its error.
struct Bend {
  double per_m = 0;
  double sigma_per_m = 0;
};

/// Cubic through height 0 and slope 0 at the mark and height and slope at the neighbour.
Bend bend_of(const Arm& arm) {
  const double h = arm.length_m;
  const double cubic = 6 * arm.height_m / (h * h) - 2 * arm.slope / h;
  const double circle = arm.slope / h;
  const double of_normals = std::hypot(4 * arm.sigma_here_rad, 2 * arm.sigma_rad) / h;
  return {cubic, std::hypot(kLeastSigmaPerM, of_normals, (cubic - circle) / 2)};
}

/// Quintic through both neighbours' heights and slopes (exact up to the fifth power).
Bend bend_of(const Arm& ahead, const Arm& behind) {
  const double h = (ahead.length_m + behind.length_m) / 2;
  const double quintic =
      2 * (ahead.height_m + behind.height_m) / (h * h) - (ahead.slope + behind.slope) / (2 * h);
  const double circle = (ahead.slope + behind.slope) / (2 * h);
  const double of_normals = std::hypot(ahead.sigma_rad, behind.sigma_rad) / (2 * h);
  return {quintic, std::hypot(kLeastSigmaPerM, of_normals, (quintic - circle) / 3)};
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

}  // namespace

SurfacePatch surface_patch(const MarksOnSurface& marks, MarkId mark, double pitch_m,
                           const Vector3d& to_cameras) {
  const MarkOnSurface& centre = marks.at(mark);
  const Vector3d normal = centre.normal ? centre.normal->normal : to_cameras;
  const auto arm = [&](int row, int col) -> std::optional<Arm> {
    if (!centre.normal) return std::nullopt;
    return arm_to(marks, {mark.row + row, mark.col + col}, centre, pitch_m);
  };
  auto warp = line_through(arm(1, 0), arm(-1, 0), normal);
  auto weft = line_through(arm(0, 1), arm(0, -1), normal);
  const auto unknown = [&](const Vector3d& tangent) {
    return Line{tangent, {0, kUnknownPerM}, Vector3d::Zero()};
  };
  if (!warp) warp = unknown(weft ? Vector3d(weft->tangent.cross(normal)) : normal.unitOrthogonal());
  if (!weft) weft = unknown(normal.cross(warp->tangent));
  SurfacePatch patch;
  patch.axis_u = warp->tangent;
  patch.axis_v = normal.cross(patch.axis_u);
  // The second form along warp, weft and both, turned to the axes (u, v).
  const double mixed = -(warp->normal_change_per_m.dot(weft->tangent) +
                         weft->normal_change_per_m.dot(warp->tangent)) /
                       2;
  Matrix2d along;
  along << warp->bend.per_m, mixed, mixed, weft->bend.per_m;
  Matrix2d tangents;  // columns: warp and weft in (u, v)
  tangents << 1, weft->tangent.dot(patch.axis_u), 0, weft->tangent.dot(patch.axis_v);
  const Matrix2d inverse = tangents.inverse();
  patch.curvature_per_m = -(inverse.transpose() * along * inverse);
  patch.curvature_sigma_per_m = std::hypot(warp->bend.sigma_per_m, weft->bend.sigma_per_m);
  if (!patch.curvature_per_m.allFinite()) patch.curvature_per_m.setZero();
  return patch;
}

std::vector<View> without_dot_shape(const std::vector<View>& views, const Vector3d& in_world,
                                    const SurfacePatch& patch, double dot_diameter_m) {
  std::vector<View> corrected = views;
  const Vector3d normal = patch.axis_u.cross(patch.axis_v);
  for (View& view : corrected) {
    const Camera& camera = view.camera->camera;
    const Eigen::Matrix3d& rotation = camera.cam_from_world.rotation;
    const Vector3d centre = camera.cam_from_world * in_world;
    const auto centre_px = project(camera.model, centre);
    const auto seen_px =
        dot_centroid_px(camera.model, {centre, rotation * patch.axis_u, rotation * patch.axis_v,
                                       dot_diameter_m / 2, patch.curvature_per_m});
    if (!centre_px || !seen_px) continue;
    view.px += centre_px->px - *seen_px;
    const Eigen::Vector2d along_normal =
        centre_px->d_px_d_point * rotation * normal * shape_sigma_m(patch, dot_diameter_m);
    view.covariance_px2 += along_normal * along_normal.transpose();
  }
  return corrected;
}

double shape_sigma_m(const SurfacePatch& patch, double dot_diameter_m) {
  // A dot of radius r on a cylinder of radius R looks 3 r^2 / (8 R) deeper than it is.
  return 3 * dot_diameter_m * dot_diameter_m / 32 * patch.curvature_sigma_per_m;
}

}  // namespace drape
