// SPDX-License-Identifier: Apache-2.0
#include "triangulate/dot_shape.hpp"

#include <Eigen/Geometry>
#include <array>

#include "core/dot_image.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kCurvatureStepPerM = 1;  // the shift is nearly linear in curvature and tilt
constexpr double kTiltStepRad = 1e-3;

SurfacePatch bent(SurfacePatch patch, int row, int col, double by_per_m) {
  patch.curvature_per_m(row, col) += by_per_m;
  if (row != col) patch.curvature_per_m(col, row) += by_per_m;
  return patch;
}

SurfacePatch tilted(SurfacePatch patch, const Vector3d& axis, double by_rad) {
  const Eigen::AngleAxisd turn(by_rad, axis);
  patch.axis_u = turn * patch.axis_u;
  patch.axis_v = turn * patch.axis_v;
  return patch;
}

}  // namespace

std::optional<DotShift> dot_shift(const Camera& camera, const Vector3d& in_world,
                                  const SurfacePatch& patch, double dot_diameter_m) {
  bool complete = true;
  const auto offset = [&](const SurfacePatch& moved) -> Vector2d {
    const Eigen::Matrix3d& rotation = camera.cam_from_world.rotation;
    const auto px = eccentricity_px(
        camera.model, {camera.cam_from_world * in_world, rotation * moved.axis_u,
                       rotation * moved.axis_v, dot_diameter_m / 2, moved.curvature_per_m});
    complete = complete && px.has_value();
    return -px.value_or(Vector2d::Zero());
  };
  const auto by = [](const auto& more, const auto& less, double step) {
    return Vector2d((more - less) / (2 * step));
  };
  DotShift shift;
  shift.px = offset(patch);
  constexpr std::array<std::array<int, 2>, 3> kPlaces = {{{0, 0}, {0, 1}, {1, 1}}};
  for (int i = 0; i < 3; ++i) {
    const auto [row, col] = kPlaces.at(i);
    shift.px_per_curvature.col(i) =
        by(offset(bent(patch, row, col, kCurvatureStepPerM)),
           offset(bent(patch, row, col, -kCurvatureStepPerM)), kCurvatureStepPerM);
  }
  const std::array<Vector3d, 2> axes = {patch.axis_u, patch.axis_v};
  for (int i = 0; i < 2; ++i) {
    shift.px_per_tilt.col(i) = by(offset(tilted(patch, axes.at(i), kTiltStepRad)),
                                  offset(tilted(patch, axes.at(i), -kTiltStepRad)), kTiltStepRad);
  }
  return complete ? std::optional(shift) : std::nullopt;
}

std::vector<View> without_dot_shape(const std::vector<View>& views, const Vector3d& in_world,
                                    const SurfacePatch& patch, const CurvatureTrust& trust,
                                    double dot_diameter_m) {
  const Vector3d curvature_sigma = patch.curvature_variance(trust).cwiseSqrt();
  std::vector<View> corrected = views;
  for (View& view : corrected) {
    view.shape_px.setZero(2, 5);
    const auto shift = dot_shift(view.camera->camera, in_world, patch, dot_diameter_m);
    if (!shift) continue;
    view.px += shift->px;
    view.shape_px << shift->px_per_curvature * curvature_sigma.asDiagonal(),
        shift->px_per_tilt * patch.normal_sigma_rad;
  }
  return corrected;
}

}  // namespace drape::triangulate
