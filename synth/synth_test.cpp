// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "core/files/files.hpp"
#include "synth/synth.hpp"
#include "synth/test_cameras.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

using namespace drape::synth;
using units::mm;

TEST(Predict, ARoundDotsBoundIsTheClosedForm) {
  // Seen from directly above: sigma = (noise / contrast) sqrt(2 s / (sqrt(pi) r)).
  Camera camera = synthetic_camera("cam0", 0, 0);
  camera.model.lens = BrownLens{3000, 3000, 800, 600};
  RenderOptions render;
  render.white_grey = 160;
  render.ink_ratio = 0.25;
  render.noise_grey = 2;
  const auto bound =
      centre_bound_px2(camera, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ(), 2 * mm, render);
  const double radius_px = 2 * mm * 3000 / 0.78;
  const double noise = std::sqrt(4 * (0.5 + 0.5 * 100 / 128.0) + 1.0 / 12);
  const double s = std::sqrt(0.55 * 0.55 + 1.0 / 12);
  const double expected =
      noise / 120 * std::sqrt(2 * s / (std::sqrt(std::numbers::pi) * radius_px));
  EXPECT_NEAR(std::sqrt((*bound)(0, 0)) / expected, 1, 0.005);
  EXPECT_NEAR(std::sqrt((*bound)(1, 1)) / expected, 1, 0.005);
  EXPECT_NEAR((*bound)(0, 1) / (*bound)(0, 0), 0, 1e-6);
}

TEST(Predict, TwoCamerasGiveTheTextbooksHeight) {
  // Two cameras at +-25 degrees: with k px/mm the error is sigma / (k sqrt 2) across the plane of
  // the rays, divided by the cosine within it, and by the sine of 25 degrees in height.
  const std::vector<Camera> cameras = {synthetic_camera("cam0", 0, 25),
                                       synthetic_camera("cam1", 180, 25)};
  PredictOptions options;
  options.height_m = 0;
  options.floor_px = 0.05;
  options.render.noise_grey = 0.001;  // only the floor: 0.05 px
  const Prediction found =
      predict(cameras, read_print(source_root() / "rigs/bench1/print.toml"), options);
  const double per_px = 780.0 / 3100 / std::sqrt(2.0);
  const double half = 25 * units::deg;
  EXPECT_NEAR(found.slopes[0].median_height_m / mm, 0.05 * per_px / std::sin(half), 2e-3);
  EXPECT_NEAR(found.slopes[0].median_m / mm,
              0.05 * per_px *
                  std::sqrt(1 + 1 / std::pow(std::cos(half), 2) + 1 / std::pow(std::sin(half), 2)),
              2e-3);
  EXPECT_EQ(found.slopes[0].seen_by_two, found.slopes[0].marks);
  EXPECT_TRUE(found.go);
  options.asked_sigma_m = 0.01 * mm;
  EXPECT_FALSE(predict(cameras, read_print(source_root() / "rigs/bench1/print.toml"), options).go);
}

TEST(Predict, CamerasThatSeeNothingTogetherAreNoGo) {
  const std::vector<Camera> cameras = {synthetic_camera("cam0", 0, 70),
                                       synthetic_camera("cam1", 180, 70)};
  const Prediction found =
      predict(cameras, read_print(source_root() / "rigs/bench1/print.toml"), PredictOptions{});
  EXPECT_FALSE(found.go);
  EXPECT_EQ(found.slopes[0].seen_by_two, 0);
}

TEST(SynthOptions, ValuesOutOfRangeAreRefusedByName) {
  for (const auto& [name, value] : {std::pair("accuracy_mm", 0.0),
                                    {"height_mm", -1.0},
                                    {"white_grey", 0.0},
                                    {"white_grey", 300.0},
                                    {"ink_ratio", 1.0},
                                    {"blur_px", -1.0},
                                    {"noise_grey", -1.0},
                                    {"weave_percent", -1.0},
                                    {"slope_deg", 85.0},
                                    {"wavelength_mm", 1.0}}) {
    Value given(Value::Table{});
    given[name] = value;
    PredictOptions prediction;
    SynthOptions options;
    const auto faults = faults_of_reading(Document(Syntax::options, given), [&](Fields& f) {
      fields(f, prediction);
      fields(f, options);
    });
    ASSERT_EQ(faults.size(), 1U) << name;
    EXPECT_NE(std::string(faults.front().what()).find(shown_path(Syntax::options, name)),
              std::string::npos)
        << name;
  }
}

using testing::HasSubstr;

Rig bench_rig() {
  return read_rig(source_root() / "rigs/bench1/rig.toml");
}

TEST(SyntheticRecording, IsReadAsAnyOtherAndSaysTheTruth) {
  const TemporaryFolder folder;
  SynthOptions options;
  options.sets = {"stage_z030", "drape_A"};
  const std::vector<Camera> cameras = three_synthetic_cameras(40);
  const SynthReport report =
      write_synthetic_recording(bench_rig(), cameras, folder.path() / "r", options);
  EXPECT_EQ(report.pictures, 6);
  EXPECT_THAT(report.not_over_objects, testing::ElementsAre("drape_A"));
  const Recording recording = read_recording(folder.path() / "r");
  ASSERT_EQ(recording.sets.size(), 2U);
  for (const FrameSet& set : recording.sets) {
    for (const RecordedFrame& frame : set.frames)
      EXPECT_FALSE(read_frame(recording, set, frame).empty());
  }
  const Truth truth = read_record<Truth>(folder.path() / "r/truth.json");
  ASSERT_EQ(truth.sets.size(), 2U);
  EXPECT_EQ(truth.sets[0].shows, Surface::target);
  const TrueMark& mark = truth.sets[0].marks.front();
  EXPECT_LT((mark.point_in_world - Eigen::Vector3d(-110, -80, 30) * mm).norm(), 1e-12);
  const TrueMarkView& seen = mark.views[1];
  const auto image = project(
      cameras[1].model, cameras[1].cam_from_world * Eigen::Vector3d(-110 * mm, -80 * mm, 30 * mm));
  EXPECT_EQ(seen.camera, "cam1");
  EXPECT_LT((*seen.px - image->px).norm(), 1e-9);
  EXPECT_EQ(seen.visible_fraction, 1);
  const Calibration calibration = read_calibration(folder.path() / "r/true_calibration.json");
  EXPECT_EQ(calibration.cameras.size(), 3U);
  EXPECT_THROW((void)write_synthetic_recording(bench_rig(), cameras, folder.path() / "r", options),
               Error);
}

TEST(SyntheticRecording, RefusesAnUnknownSetByName) {
  const TemporaryFolder folder;
  SynthOptions options;
  options.sets = {"drape_Z"};
  try {
    (void)write_synthetic_recording(bench_rig(), three_synthetic_cameras(40), folder.path() / "r",
                                    options);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("drape_Z"));
    EXPECT_THAT(error.what(), HasSubstr("stage_z000"));
  }
}

TEST(PlannedCameras, LookWhereThePlanSays) {
  const TemporaryFolder folder;
  write_durable(folder.path() / "plan.toml",
                "schema = \"drapebench/cameras-plan/1\"\n"
                "[[camera]]\nname = \"cam1\"\nfocal_mm = 10.7\nposition_mm = [0, -500, 600]\n"
                "[[camera]]\nname = \"cam0\"\nfocal_mm = 10.7\nposition_mm = [400, 0, 600]\n"
                "look_at_mm = [0, 0, 40]\nk1 = -0.1\n"
                "[[camera]]\nname = \"cam2\"\nfocal_mm = 10.7\nposition_mm = [0, 0, 700]\n");
  const auto cameras = read_planned_cameras(folder.path() / "plan.toml", bench_rig());
  ASSERT_EQ(cameras.size(), 3U);
  EXPECT_EQ(cameras[0].name, "cam0");
  EXPECT_LT((centre_in_world(cameras[1]) - Eigen::Vector3d(0, -0.5, 0.6)).norm(), 1e-12);
  const Eigen::Vector3d target_in_camera = cameras[0].cam_from_world * Eigen::Vector3d(0, 0, 0.04);
  const auto image = project(cameras[0].model, target_in_camera);
  EXPECT_LT((image->px - Eigen::Vector2d(799.5, 599.5)).norm(), 1e-9);
  EXPECT_GT(cameras[2].cam_from_world.rotation.determinant(), 0.999);
  write_durable(folder.path() / "short.toml",
                "schema = \"drapebench/cameras-plan/1\"\n"
                "[[camera]]\nname = \"cam0\"\nfocal_mm = 10.7\nposition_mm = [400, 0, 600]\n");
  EXPECT_THROW((void)read_planned_cameras(folder.path() / "short.toml", bench_rig()), Error);
}

using Eigen::Vector2d;
using units::deg;

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

namespace drape::synth {
namespace {

using Eigen::Vector3d;
using units::mm;

Scene with(const Obstacle& obstacle) {
  Scene scene;
  scene.table_z_m = -50 * mm;
  scene.obstacles = {obstacle};
  return scene;
}

/// Triangles other than the table's.
std::vector<Triangle> object_of(const Obstacle& obstacle) {
  std::vector<Triangle> all = triangles_of(with(obstacle));
  all.erase(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(table_triangles(0).size()));
  return all;
}

TEST(Scenery, EachObjectHasItsSurfaceWithNormalsOutwards) {
  const Sphere sphere{Vector3d(10, 20, 30) * mm, 40 * mm};
  for (const Triangle& t : object_of(sphere)) {
    for (int k = 0; k < 3; ++k) {
      const Vector3d out = t.corners_in_world[k] - sphere.centre_in_world;
      EXPECT_NEAR(out.norm(), sphere.radius_m, 1e-12);
      EXPECT_GT(out.dot(t.normals_in_world[k]), 0.039);
    }
  }
  Box box;
  box.size_m = Vector3d(20, 40, 60) * mm;
  for (const Triangle& t : object_of(box)) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR((t.corners_in_world[k].cwiseQuotient(box.size_m)).cwiseAbs().maxCoeff(), 0.5,
                  1e-12);
      EXPECT_GT(t.corners_in_world[k].dot(t.normals_in_world[k]), 0);
    }
  }
}

TEST(Scenery, APlaneIsRenderedAroundItsPoint) {
  const Plane plane{Vector3d(0, 0, 12) * mm, Vector3d(0.6, 0, 0.8)};
  const std::vector<Triangle> all = object_of(plane);
  ASSERT_FALSE(all.empty());
  for (const Triangle& t : all) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR((t.corners_in_world[k] - plane.point_in_world).dot(plane.normal_in_world), 0,
                  1e-12);
    }
  }
}

TEST(Scenery, WhatIsDrawnInLiesWithinTheRoundedSolid) {
  Box box;
  box.size_m = Vector3d(80, 80, 80) * mm;
  box.edge_radius_m = 5 * mm;
  const Scene inner = drawn_in(with(box), 1 * mm);
  EXPECT_NEAR(inner.table_z_m, -51 * mm, 1e-12);
  const Vector3d corner = std::get<Box>(inner.obstacles.front()).size_m / 2;
  // The rounded corner is an eighth of a ball; the drawn corner is 1 mm or more inside it.
  const Vector3d ball = Vector3d::Constant(35 * mm);
  EXPECT_LE((corner - ball).norm(), box.edge_radius_m - 1 * mm);
  const Scene ball_scene = drawn_in(with(Sphere{Vector3d(0, 0, 40) * mm, 40 * mm}), 1 * mm);
  EXPECT_NEAR(std::get<Sphere>(ball_scene.obstacles.front()).radius_m, 39 * mm, 1e-12);
}

TEST(Scenery, AMeshIsRefusedByName) {
  try {
    (void)triangles_of(with(MeshObject{"head.obj", {}}));
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("head.obj"));
    EXPECT_THAT(error.what(), testing::HasSubstr("cannot be rendered"));
  }
}

}  // namespace
}  // namespace drape::synth
