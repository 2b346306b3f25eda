// SPDX-License-Identifier: Apache-2.0
#include "synth/predict.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::synth {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::deg;

/// One mark of the volume, with its covariance if two cameras see it.
struct PredictedMark {
  std::optional<Matrix3d> covariance_m2;
  std::vector<double> sigmas_px;
};

bool is_in_picture(const CameraModel& model, const Vector2d& px, double border_px) {
  return px.x() > border_px && px.y() > border_px && px.x() < model.width_px - 1 - border_px &&
         px.y() < model.height_px - 1 - border_px;
}

PredictedMark predicted(const std::vector<Camera>& cameras, const Vector3d& at,
                        const Vector3d& normal, double radius_m, const PredictOptions& options) {
  PredictedMark mark;
  Matrix3d information = Matrix3d::Zero();
  int views = 0;
  for (const Camera& camera : cameras) {
    const Vector3d to_camera = (centre_in_world(camera) - at).normalized();
    if (to_camera.dot(normal) < std::cos(options.most_facing_deg * deg)) continue;
    const auto image = project(camera.model, camera.cam_from_world * at);
    constexpr double border_px = 12;
    if (!image || !is_in_picture(camera.model, image->px, border_px)) continue;
    const auto bound = centre_bound_px2(camera, at, normal, radius_m, options.render);
    if (!bound) continue;
    mark.sigmas_px.push_back(std::sqrt(bound->trace() / 2));
    const Matrix2d covariance = *bound + options.floor_px * options.floor_px * Matrix2d::Identity();
    const Eigen::Matrix<double, 2, 3> jacobian =
        image->d_px_d_point * camera.cam_from_world.rotation;
    information += jacobian.transpose() * covariance.inverse() * jacobian;
    ++views;
  }
  if (views >= 2) mark.covariance_m2 = information.inverse();
  return mark;
}

/// Sample positions over the patch and the height of the volume.
std::vector<Vector3d> places(const Print& print, double height_m) {
  std::vector<Vector3d> all;
  for (const double z : {0.0, 0.5, 1.0}) {
    for (int j = 0; j < 5; ++j) {
      for (int i = 0; i < 5; ++i)
        all.emplace_back((i / 4.0 - 0.5) * 0.9 * print.patch_m.y(),
                         (j / 4.0 - 0.5) * 0.9 * print.patch_m.x(), z * height_m);
    }
  }
  return all;
}

struct Counts {
  int marks = 0, seen = 0, reached = 0;
};

PredictedSlope slope_of(const std::vector<Camera>& cameras, const Print& print, double slope_deg,
                        const PredictOptions& options, Counts& counts) {
  PredictedSlope result;
  result.slope_deg = slope_deg;
  std::vector<double> sigmas, heights, pixels;
  const int sides = slope_deg == 0 ? 1 : 8;
  for (const Vector3d& at : places(print, options.height_m)) {
    for (int side = 0; side < sides; ++side) {
      const double angle = 2 * std::numbers::pi * side / sides;
      const double slope = slope_deg * deg;
      const Vector3d normal(std::sin(slope) * std::cos(angle), std::sin(slope) * std::sin(angle),
                            std::cos(slope));
      const auto mark = predicted(cameras, at, normal, print.dot_diameter_m / 2, options);
      ++result.marks;
      pixels.insert(pixels.end(), mark.sigmas_px.begin(), mark.sigmas_px.end());
      if (!mark.covariance_m2) continue;
      ++result.seen_by_two;
      sigmas.push_back(std::sqrt(mark.covariance_m2->trace()));
      heights.push_back(std::sqrt((*mark.covariance_m2)(2, 2)));
      counts.reached += sigmas.back() <= options.asked_sigma_m;
    }
  }
  counts.marks += result.marks;
  counts.seen += result.seen_by_two;
  if (!pixels.empty()) result.median_px = quantile(pixels, 0.5);
  if (sigmas.empty()) return result;
  result.median_m = quantile(sigmas, 0.5);
  result.p95_m = quantile(sigmas, 0.95);
  result.median_height_m = quantile(heights, 0.5);
  return result;
}

}  // namespace

void fields(Fields& f, PredictOptions& o) {
  f.otherwise(
      {"accuracy_mm", "required standard deviation of a mark in space", units::mm, above_zero},
      o.asked_sigma_m);
  f.otherwise({"height_mm", "height of the drape's volume above the origin", units::mm, 0},
              o.height_m);
}

std::optional<Matrix2d> centre_bound_px2(const Camera& camera, const Vector3d& in_world,
                                         const Vector3d& normal, double radius_m,
                                         const RenderOptions& render) {
  constexpr int nodes = 48;
  const Vector3d u = normal.unitOrthogonal();
  const Vector3d v = normal.cross(u);
  const double white = render.white_grey, black = render.white_grey * render.ink_ratio;
  const double variance =
      render.noise_grey * render.noise_grey * (0.5 + 0.5 * (white + black) / 2 / 128);
  const double blur = std::sqrt(render.blur_px * render.blur_px + 1.0 / 12);
  Matrix2d around = Matrix2d::Zero();  // sum along the outline of n n', with n its normal, px
  std::optional<Vector2d> last;
  for (int k = 0; k <= nodes; ++k) {
    const double angle = 2 * std::numbers::pi * k / nodes;
    const Vector3d point = in_world + radius_m * (std::cos(angle) * u + std::sin(angle) * v);
    const auto image = project(camera.model, camera.cam_from_world * point);
    if (!image) return std::nullopt;
    if (last) {
      const Vector2d along = image->px - *last;
      const Vector2d across(-along.y(), along.x());
      around += across * across.transpose() / std::max(along.norm(), 1e-12);
    }
    last = image->px;
  }
  const double contrast = white - black;
  const double edge =
      contrast * contrast / (variance + 1.0 / 12) / (2 * blur * std::sqrt(std::numbers::pi));
  return Matrix2d((edge * around).inverse());
}

Prediction predict(const std::vector<Camera>& cameras, const Print& print,
                   const PredictOptions& options) {
  Prediction result;
  Counts counts, gentle;
  for (const double slope_deg : {0.0, 30.0, 45.0, 60.0}) {
    result.slopes.push_back(slope_of(cameras, print, slope_deg, options, counts));
    if (slope_deg <= 45) gentle = counts;
  }
  const auto fraction = [](int part, int whole) { return whole == 0 ? 0.0 : part / double(whole); };
  result.reached_fraction = fraction(gentle.reached, gentle.seen);
  result.seen_fraction = fraction(gentle.seen, gentle.marks);
  result.go = result.reached_fraction >= options.asked_fraction && gentle.seen > 0;
  return result;
}

}  // namespace drape::synth
