// SPDX-License-Identifier: Apache-2.0
#include "synth/synth.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/fields/records.hpp"
#include "core/units.hpp"
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

}  // namespace
}  // namespace drape::test
