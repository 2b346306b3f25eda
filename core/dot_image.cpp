// SPDX-License-Identifier: Apache-2.0
#include "core/dot_image.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace drape {

std::optional<Eigen::Vector2d> dot_centroid_px(const CameraModel& model, const DotInCamera& dot) {
  using Eigen::Vector2d;
  using Eigen::Vector3d;
  // The outline is smooth and periodic, so the trapezoidal rule converges exponentially.
  constexpr int kNodes = 16;
  const std::optional<Projection> centre = project(model, dot.centre);
  if (!centre) return std::nullopt;
  const Vector3d normal = dot.axis_u.cross(dot.axis_v);
  const double r = dot.radius_m;
  double area2 = 0;                    // twice the area, px^2
  Vector2d moment = Vector2d::Zero();  // first moment of the area about the image of the centre
  for (int i = 0; i < kNodes; ++i) {
    const double angle = 2 * std::numbers::pi * i / kNodes;
    const Vector2d e(std::cos(angle), std::sin(angle));
    const Vector2d e_slope(-e.y(), e.x());
    const Vector2d bent = dot.curvature_per_m * e;
    const Vector3d point = dot.centre + r * (e.x() * dot.axis_u + e.y() * dot.axis_v) -
                           0.5 * r * r * e.dot(bent) * normal;
    const Vector3d tangent = r * (e_slope.x() * dot.axis_u + e_slope.y() * dot.axis_v) -
                             r * r * e_slope.dot(bent) * normal;
    const std::optional<Projection> image = project(model, point);
    if (!image) return std::nullopt;
    const Vector2d p = image->px - centre->px;
    const Vector2d d = image->d_px_d_point * tangent;
    area2 += p.x() * d.y() - p.y() * d.x();
    moment += Vector2d(p.x() * p.x() * d.y(), -p.y() * p.y() * d.x());
  }
  const Vector2d offset = moment / area2;
  if (!offset.allFinite()) return std::nullopt;
  return centre->px + offset;
}

std::optional<Eigen::Vector2d> eccentricity_px(const CameraModel& model, const DotInCamera& dot) {
  const auto centroid = dot_centroid_px(model, dot);
  const auto centre = project(model, dot.centre);
  if (!centroid || !centre) return std::nullopt;
  return Eigen::Vector2d(*centroid - centre->px);
}

}  // namespace drape
