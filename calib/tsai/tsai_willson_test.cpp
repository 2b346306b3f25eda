// SPDX-License-Identifier: Apache-2.0
// Compares with Willson's Tsai calibration 3.0b3: his data, his results and an independent optimum.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "calib/tsai/tsai.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"

namespace drape::calib {
namespace {

using units::deg;
using units::mm;

std::vector<Correspondence> read_points(const std::filesystem::path& file) {
  std::istringstream text(read_text(file));
  std::vector<Correspondence> points;
  double x, y, z, u, v;
  while (text >> x >> y >> z >> u >> v) points.push_back({Eigen::Vector3d(x, y, z) * mm, {u, v}});
  return points;
}

/// Sensor pitch and initial centre of the parameter files supplied.
TsaiSensor willson_sensor() {
  return {0.023 * mm, 0.023 * mm, 258, 204};
}

struct Angles {
  double rx, ry, rz;  // degrees
};

Angles angles_of(const Eigen::Matrix3d& r) {
  return {std::atan2(r(2, 1), r(2, 2)) / deg, std::asin(-r(2, 0)) / deg,
          std::atan2(r(1, 0), r(0, 0)) / deg};
}

double sum_of_squares(const Camera& camera, const std::vector<Correspondence>& points) {
  const CalibrationResiduals r = residuals_of(camera, points);
  return r.rms_px * r.rms_px * r.points;
}

constexpr double kSixDecimals = 1.01e-6;

TEST(TsaiWillson, NonCoplanarStage1EqualsHisToSixDecimals) {
  const std::filesystem::path folder = drape::test::test_data("tsai-willson-3.0b3");
  const auto points = read_points(folder / "ncc_cd.dat");
  ASSERT_EQ(points.size(), 300u);
  const auto alignment = align_non_coplanar(points, willson_sensor());
  ASSERT_TRUE(alignment);
  const Angles angles = angles_of(alignment->rotation);
  EXPECT_NEAR(angles.rx, 29.843070, kSixDecimals);
  EXPECT_NEAR(angles.ry, 1.103189, kSixDecimals);
  EXPECT_NEAR(angles.rz, 2.001919, kSixDecimals);
  EXPECT_NEAR(alignment->ty_m / mm, -79.794913, kSixDecimals);
  EXPECT_NEAR(alignment->scale_x, 1.000158, kSixDecimals);
  // His Tx is ours times s_x.
  EXPECT_NEAR(alignment->tx_m / mm * alignment->scale_x, -97.408705, kSixDecimals);
  EXPECT_FALSE(alignment->origin_shifted);
}

TEST(TsaiWillson, CoplanarStage1EqualsHisToSixDecimals) {
  const std::filesystem::path folder = drape::test::test_data("tsai-willson-3.0b3");
  const auto points = read_points(folder / "cc_cd.dat");
  ASSERT_EQ(points.size(), 100u);
  auto alignment = align_coplanar(points, willson_sensor());
  ASSERT_TRUE(alignment);
  const auto depth = solve_focal_and_depth(points, willson_sensor(), *alignment);
  ASSERT_TRUE(depth);
  if (depth->focal_m < 0) alignment = mirrored(*alignment);
  const Angles angles = angles_of(alignment->rotation);
  EXPECT_NEAR(angles.rx, 20.059182, kSixDecimals);
  EXPECT_NEAR(angles.ry, 5.194842, kSixDecimals);
  EXPECT_NEAR(angles.rz, 88.005639, kSixDecimals);
  EXPECT_NEAR(alignment->tx_m / mm, 152.194102, kSixDecimals);
  EXPECT_NEAR(alignment->ty_m / mm, -70.609515, kSixDecimals);
}

/// Stages 2 and 3 from an alignment.
Refinement full(const std::vector<Correspondence>& points, const RadialAlignment& alignment,
                TsaiFree free) {
  const auto depth = solve_focal_and_depth(points, willson_sensor(), alignment);
  const Camera start = start_camera(willson_sensor(), alignment, *depth);
  const Refinement basic = refine_tsai(start, points, TsaiFree::focal_depth_kappa, 500);
  return refine_tsai(basic.camera, points, free, 500);
}

TEST(TsaiWillson, NonCoplanarFullOptimumIsTheTrueOne) {
  const std::filesystem::path folder = drape::test::test_data("tsai-willson-3.0b3");
  const auto points = read_points(folder / "ncc_cd.dat");
  const Refinement result =
      full(points, *align_non_coplanar(points, willson_sensor()), TsaiFree::all);
  EXPECT_TRUE(result.converged);
  EXPECT_LE(sum_of_squares(result.camera, points), 2.39976);
  EXPECT_LE(normalised_error(result.camera, points), 0.19357);
  const auto reference = parse_json(
      read_text(folder / "reference_results.json"))["ncc"]["lm_optimum_distorted"]["params"];
  const auto& lens = std::get<TsaiLens>(result.camera.model.lens);
  EXPECT_NEAR(lens.focal_m / mm, reference["f"].get<double>(), 1e-4);
  EXPECT_NEAR(lens.cx_px, reference["Cx"].get<double>(), 1e-4);
  EXPECT_NEAR(lens.cy_px, reference["Cy"].get<double>(), 1e-4);
  EXPECT_NEAR(lens.scale_x, reference["sx"].get<double>(), 1e-7);
}

TEST(TsaiWillson, GeneratorTruthLiesWithinThreeSigmaOfTheOptimum) {
  const std::filesystem::path folder = drape::test::test_data("tsai-willson-3.0b3");
  const auto points = read_points(folder / "ncc_cd.dat");
  const Refinement result =
      full(points, *align_non_coplanar(points, willson_sensor()), TsaiFree::all);
  const Eigen::MatrixXd covariance =
      tsai_covariance(result.camera, points, TsaiFree::all) * (result.chi2 / (600.0 - 11.0));
  ASSERT_EQ(covariance.rows(), 11);
  const auto& lens = std::get<TsaiLens>(result.camera.model.lens);
  const double truth[] = {70, -0.0006, 262, 212, 1};
  const double found[] = {lens.focal_m / mm, lens.kappa1_per_m2 * mm * mm, lens.cx_px, lens.cy_px,
                          lens.scale_x};
  for (int i = 0; i < 5; ++i)
    EXPECT_LT(std::abs(found[i] - truth[i]), 3 * std::sqrt(covariance(i, i))) << i;
  // Standard deviations from the independent optimum.
  EXPECT_NEAR(std::sqrt(covariance(0, 0)), 0.22931, 1e-4);
  EXPECT_NEAR(std::sqrt(covariance(2, 2)), 0.42542, 1e-4);
  EXPECT_NEAR(std::sqrt(covariance(4, 4)), 9.5954e-5, 1e-8);
}

TEST(TsaiWillson, CoplanarFullOptimumIsTheTrueOne) {
  const std::filesystem::path folder = drape::test::test_data("tsai-willson-3.0b3");
  const auto points = read_points(folder / "cc_cd.dat");
  auto alignment = align_coplanar(points, willson_sensor());
  const auto depth = solve_focal_and_depth(points, willson_sensor(), *alignment);
  if (depth->focal_m < 0) alignment = mirrored(*alignment);
  const Refinement result = full(points, *alignment, TsaiFree::all_but_scale_x);
  EXPECT_TRUE(result.converged);
  EXPECT_LE(sum_of_squares(result.camera, points), 1.21365);
  EXPECT_LE(normalised_error(result.camera, points), 0.23182);
}

TEST(TsaiWillson, CoplanarGeneratorTruthLiesWithinThreeSigmaOfTheOptimum) {
  const std::filesystem::path folder = drape::test::test_data("tsai-willson-3.0b3");
  const auto points = read_points(folder / "cc_cd.dat");
  auto alignment = align_coplanar(points, willson_sensor());
  const auto depth = solve_focal_and_depth(points, willson_sensor(), *alignment);
  if (depth->focal_m < 0) alignment = mirrored(*alignment);
  const Refinement result = full(points, *alignment, TsaiFree::all_but_scale_x);
  const Eigen::MatrixXd covariance =
      tsai_covariance(result.camera, points, TsaiFree::all_but_scale_x) *
      (result.chi2 / (200.0 - 10.0));
  const auto& lens = std::get<TsaiLens>(result.camera.model.lens);
  const Eigen::Vector3d t = result.camera.cam_from_world.translation_m / mm;
  const double truth[] = {270, -0.0006, 262, 212, 150, -75, 6600};
  const double found[] = {
      lens.focal_m / mm, lens.kappa1_per_m2 * mm * mm, lens.cx_px, lens.cy_px, t.x(), t.y(), t.z()};
  const int place[] = {0, 1, 2, 3, 8, 9, 10};
  for (int i = 0; i < 7; ++i)
    EXPECT_LT(std::abs(found[i] - truth[i]), 3 * std::sqrt(covariance(place[i], place[i]))) << i;
  // Standard deviations from the independent optimum.
  EXPECT_NEAR(std::sqrt(covariance(0, 0)), 13.979, 0.01);
  EXPECT_NEAR(std::sqrt(covariance(10, 10)), 343.82, 0.2);
}

TEST(TsaiWillson, TheFourClassicalErrorsEqualAnIndependentEvaluation) {
  const std::filesystem::path folder = drape::test::test_data("tsai-willson-3.0b3");
  const auto points = read_points(folder / "ncc_cd.dat");
  const Refinement result =
      full(points, *align_non_coplanar(points, willson_sensor()), TsaiFree::all);
  const ClassicalErrors errors = classical_errors(result.camera, points);
  const auto reference =
      parse_json(read_text(folder / "reference_results.json"))["ncc"]["lm_optimum_distorted"];
  const auto expect = [&](const ErrorMeasure& measure, const char* name) {
    EXPECT_NEAR(measure.mean, reference[name]["mean"].get<double>(), 1e-6) << name;
    EXPECT_NEAR(measure.max, reference[name]["max"].get<double>(), 1e-5) << name;
  };
  expect(errors.distorted_px, "distorted_px");
  expect(errors.undistorted_px, "undistorted_px");
  expect(errors.object_mm, "object_mm");
  EXPECT_NEAR(errors.normalised, reference["nce"].get<double>(), 1e-6);
}

}  // namespace
}  // namespace drape::calib
