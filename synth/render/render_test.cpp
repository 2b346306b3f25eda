// SPDX-License-Identifier: Apache-2.0
#include "synth/render/render.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/camera_model.hpp"
#include "core/units.hpp"
#include "synth/synth.hpp"
#include "synth/test_cameras.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

using namespace drape::synth;
using Eigen::Vector2d;
using units::deg;
using units::mm;

Print bench_print() {
  return read_print(source_root() / "rigs/bench1/print.toml");
}

SyntheticScene folds_scene(double slope_deg, bool dots_only) {
  Folds folds;
  folds.slope_rad = slope_deg * deg;
  folds.direction_rad = 0.4;
  folds.yaw_rad = 0.2;
  folds.phase_rad = 1.1;
  Print print = bench_print();
  if (dots_only) print.tags.clear();
  return {folded(print, folds), FacePattern(face_of(print)), {}};
}

/// Options with which only the print changes the light: the missing light is the dot's area.
RenderOptions plain() {
  RenderOptions options;
  options.ambient = 1;
  options.white_grey = 200;
  options.ink_ratio = 0;
  return options;
}

using Polygon = std::vector<Vector2d>;

/// Area of a polygon inside the pixel (u, v), integrated independently of the renderer.
double area_in_pixel(Polygon polygon, int u, int v) {
  const auto keep = [&](int axis, double limit, double sign) {
    Polygon kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector2d& a = polygon[i];
      const Vector2d& b = polygon[(i + 1) % polygon.size()];
      const double da = sign * (a[axis] - limit), db = sign * (b[axis] - limit);
      if (da >= 0) kept.push_back(a);
      if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + da / (da - db) * (b - a));
    }
    polygon = kept;
  };
  keep(0, u - 0.5, 1);
  keep(0, u + 0.5, -1);
  keep(1, v - 0.5, 1);
  keep(1, v + 0.5, -1);
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(twice) / 2;
}

Polygon outline_px(const GridSurface& surface, const Camera& camera, const FacePoint& centre) {
  Polygon outline;
  for (int k = 0; k < 1000; ++k) {
    const double angle = 2 * std::numbers::pi * k / 1000;
    const FacePoint at = centre + 2 * mm * FacePoint(std::cos(angle), std::sin(angle));
    const Eigen::Vector3d point = camera.cam_from_world * *surface.point_in_world(at);
    outline.push_back(project(camera.model, point)->px);
  }
  return outline;
}

/// Distance of the picture's dot from the one with the exact area of each pixel: difference of the
/// first moments over the dot's area. (The mean over pixels is not the exact centroid, because a
/// pixel does not record where in it the light fell; this holds for both pictures.)
double centre_error_px(const std::vector<double>& light, int width, const Polygon& outline) {
  Vector2d least = outline[0], most = outline[0];
  for (const Vector2d& p : outline) {
    least = least.cwiseMin(p);
    most = most.cwiseMax(p);
  }
  double area = 0;
  Vector2d moment = Vector2d::Zero();
  for (int v = static_cast<int>(least.y()) - 1; v <= most.y() + 2; ++v) {
    for (int u = static_cast<int>(least.x()) - 1; u <= most.x() + 2; ++u) {
      const double expected = area_in_pixel(outline, u, v);
      const double found = 1 - light[static_cast<std::size_t>(v) * width + u] / 200;
      area += expected;
      moment += (found - expected) * (Vector2d(u, v) - outline[0]);
    }
  }
  return moment.norm() / area;
}

void expect_exact_centres(const SyntheticScene& scene, int least_marks) {
  const Camera camera = synthetic_camera("cam0", 30, 40);
  const PixelRays rays(camera.model);
  const SceneView view(scene, camera, rays);
  const auto light = view.light(plain());
  int checked = 0;
  double largest = 0;
  for (const TrueMark& mark : truth_of(scene, marks_of(bench_print()), {&view})) {
    const TrueMarkView& seen = mark.views[0];
    const bool inside = mark.mark.row % 2 == 1 && mark.mark.col % 2 == 1;
    if (!inside || !seen.is_whole() || seen.facing_rad > 75 * deg) continue;
    const FacePoint centre = face_point(bench_print(), mark.mark);
    largest = std::max(
        largest, centre_error_px(light, rays.width(), outline_px(scene.surface, camera, centre)));
    ++checked;
  }
  EXPECT_GE(checked, least_marks);
  EXPECT_LT(largest, 1e-4) << "px, over " << checked << " dots";
  testing::Test::RecordProperty("largest_px", std::to_string(largest));
}

TEST(Render, CentresOfAFlatClothAreKnownToTheTenthOfAMilliPixel) {
  expect_exact_centres(folds_scene(0, true), 25);
}

TEST(Render, CentresOfAFoldedClothAreKnownToTheTenthOfAMilliPixel) {
  expect_exact_centres(folds_scene(45, true), 12);
}

TEST(Render, TruthAgreesWithTheClosedFormOfAPlaneDot) {
  const Print print = bench_print();
  const SyntheticScene scene = folds_scene(0, true);
  const Camera camera = synthetic_camera("cam0", 30, 40);
  const FacePoint centre = face_point(print, {3, 7});
  const Eigen::Vector3d at = *scene.surface.point_in_world(centre);
  const Eigen::Vector3d normal = scene.surface.normal_in_world(centre);
  const Eigen::Matrix3d& turn = camera.cam_from_world.rotation;
  DotInCamera dot;
  dot.centre = camera.cam_from_world * at;
  dot.axis_u = turn * normal.unitOrthogonal();
  dot.axis_v = (turn * normal).cross(dot.axis_u);
  dot.radius_m = print.dot_diameter_m / 2;
  const auto expected = dot_centroid_px(camera.model, dot);
  const auto found = disc_centroid_px(scene.surface, camera, centre, dot.radius_m);
  EXPECT_LT((*expected - *found).norm(), 1e-6);
}

TEST(Render, FoldsDoNotStretchTheCloth) {
  const SyntheticScene scene = folds_scene(60, true);
  for (const FacePoint& at : {FacePoint(0.03, 0.05), FacePoint(0.1, 0.11), FacePoint(0.2, 0.18)}) {
    for (const FacePoint& step : {FacePoint(2 * mm, 0), FacePoint(0, 2 * mm)}) {
      const Eigen::Vector3d a = *scene.surface.point_in_world(at);
      const Eigen::Vector3d b = *scene.surface.point_in_world(at + step);
      EXPECT_NEAR((a - b).norm() / (2 * mm), 1, 0.01);
    }
  }
}

TEST(Render, SamePictureAtAnyThreadCount) {
  const SyntheticScene scene = folds_scene(60, false);
  const Camera camera = synthetic_camera("cam0", 30, 40);
  const PixelRays rays(camera.model);
  const SceneView view(scene, camera, rays);
  RenderOptions options;
  options.weave_rms = 0.03;
  options.gradient_per_px = 0.002;
  std::vector<std::uint8_t> first;
  for (const int threads : {1, 2, 5}) {
    options.threads = threads;
    const GreyPicture picture = expose(view.light(options), 1600, 1200, 7, options);
    if (threads == 1) first = picture.bytes;
    EXPECT_EQ(picture.bytes, first) << threads << " threads";
  }
  EXPECT_NE(expose(view.light(options), 1600, 1200, 8, options).bytes, first);
}

TEST(Render, NoiseAndBlurAreWhatWasAskedFor) {
  const std::vector<double> even(200 * 200, 128.0);
  RenderOptions options;
  options.noise_grey = 2;
  const GreyPicture picture = expose(even, 200, 200, 1, options);
  double sum = 0, squares = 0;
  for (const std::uint8_t level : picture.bytes) {
    sum += level;
    squares += level * level;
  }
  const double mean = sum / 40000, variance = squares / 40000 - mean * mean;
  EXPECT_NEAR(mean, 128, 4 * 2 / 200.0);
  EXPECT_NEAR(variance, 4 + 1 / 12.0, 4 * 4.08 * std::sqrt(2 / 40000.0));
  std::vector<double> point(41 * 41, 0.0);
  point[20 * 41 + 20] = 2000;
  options.noise_grey = 0;
  options.blur_px = 2;
  const GreyPicture spread = expose(point, 41, 41, 1, options);
  double all = 0, second = 0;
  for (int v = 0; v < 41; ++v) {
    for (int u = 0; u < 41; ++u) {
      all += spread.bytes[v * 41 + u];
      second += spread.bytes[v * 41 + u] * (u - 20) * (u - 20);
    }
  }
  EXPECT_NEAR(second / all, 4, 0.25);
}

}  // namespace
}  // namespace drape::test
