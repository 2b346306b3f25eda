// SPDX-License-Identifier: Apache-2.0
#include "console/coach/coach.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <random>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::console {
namespace {

using Eigen::Vector3d;
using units::deg;
using units::mm;

Target board() {
  Target target;
  target.rows = 9;
  target.cols = 12;
  target.pitch_m = 15 * mm;
  return target;
}

/// A camera that looks at the origin from there.
CalibratedCamera camera_at(const std::string& name, const Vector3d& centre) {
  CalibratedCamera one;
  BrownLens lens;
  lens.fx_px = lens.fy_px = 1800;
  lens.cx_px = 639.5;
  lens.cy_px = 511.5;
  one.camera.name = name;
  one.camera.model = {lens, 1280, 1024};
  const Vector3d forward = -centre.normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  one.camera.cam_from_world = {rotation, -rotation * centre};
  return one;
}

Calibration rig_of_three() {
  Calibration calibration;
  calibration.cameras = {camera_at("a", {-0.5, -0.6, 0.7}), camera_at("b", {0.5, -0.6, 0.7}),
                         camera_at("c", {0.0, 0.7, 0.7})};
  const Eigen::Index size = 3 * 15;
  calibration.joint_covariance = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index k = 0; k < size; ++k)
    calibration.joint_covariance(k, k) = k % 15 < 4    ? 0.04
                                         : k % 15 < 9  ? 1e-8
                                         : k % 15 < 12 ? 1e-10
                                                       : 1e-4;
  return calibration;
}

Volume volume() {
  return {{-0.1, -0.1, 0}, {0.1, 0.1, 0.1}};
}

/// What the cameras see of the board, with Gaussian noise.
std::vector<FrameDetections> look(const Calibration& calibration, const WorldFromTarget& pose,
                                  double sigma_px, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, sigma_px);
  std::vector<FrameDetections> frames;
  for (const CalibratedCamera& one : calibration.cameras) {
    FrameDetections frame;
    frame.camera = one.camera.name;
    for (int row = 0; row < 9; ++row)
      for (int col = 0; col < 12; ++col) {
        const auto image =
            project(one.camera.model,
                    one.camera.cam_from_world * (pose * board().point_in_target({row, col})));
        if (!image) continue;
        Detection dot;
        dot.mark = {row, col};
        dot.centre_px = image->px;
        dot.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
        dot.semi_axes_px = {10, 10};
        if (sigma_px > 0) dot.centre_px += Eigen::Vector2d(noise(random), noise(random));
        frame.detections.push_back(dot);
      }
    frames.push_back(frame);
  }
  return frames;
}

WorldFromTarget tilted() {
  WorldFromTarget pose;
  pose.rotation =
      Eigen::AngleAxisd(20 * deg, Vector3d(1, 0.3, 0.2).normalized()).toRotationMatrix();
  pose.translation_m = {0.01, -0.02, 0.05};
  return pose;
}

TEST(MeasuredTarget, FindsThePoseOfABoardThatItKnowsNothingOf) {
  const Calibration calibration = rig_of_three();
  const auto found = measure_target(calibration, board(), look(calibration, tilted(), 0, 1));
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->points, 108);
  EXPECT_LT(found->rms_m, 1e-9);
  EXPECT_LT((found->world_from_target.translation_m - tilted().translation_m).norm(), 1e-9);
  EXPECT_LT((found->world_from_target.rotation - tilted().rotation).norm(), 1e-9);
}

TEST(MeasuredTarget, ItsErrorIsThatOfTheMarks) {
  const Calibration calibration = rig_of_three();
  const Coach coach(calibration, board(), volume(), {0.05, 0.05, 0.05});
  double sum = 0;
  constexpr int kTimes = 20;
  for (unsigned seed = 0; seed < kTimes; ++seed)
    sum += measure_target(calibration, board(), look(calibration, tilted(), 0.05, seed))->rms_m;
  // Rays instead of pixels, and six parameters of 324 taken by the pose: a few percent apart.
  EXPECT_NEAR(sum / kTimes, coach.now().marks_m, 0.15 * coach.now().marks_m);
}

TEST(MeasuredTarget, OneCameraMeasuresNothing) {
  const Calibration calibration = rig_of_three();
  std::vector<FrameDetections> frames = look(calibration, tilted(), 0, 1);
  frames.resize(1);
  EXPECT_FALSE(measure_target(calibration, board(), frames).has_value());
}

TEST(Coach, PredictsTheScatterThatRandomCalibrationsHave) {
  const Calibration truth = rig_of_three();
  const Coach coach(truth, board(), volume(), {0.05, 0.05, 0.05});
  // Only image centres vary: their effect on a triangulated point is found by doing it.
  Calibration known = truth;
  known.joint_covariance.setZero();
  for (const Eigen::Index camera : {0, 1, 2})
    for (const Eigen::Index k : {2, 3})
      known.joint_covariance(15 * camera + k, 15 * camera + k) = 0.04;
  const double predicted = Coach(known, board(), volume(), {0.05, 0.05, 0.05}).now().calibration_m;
  std::mt19937 random(7);
  std::normal_distribution<double> shift(0, 0.2);
  WorldFromTarget flat;
  double sum = 0;
  int points = 0;
  for (int trial = 0; trial < 60; ++trial) {
    flat.translation_m = {0, 0, 0.05 * (trial % 3)};
    const std::vector<FrameDetections> frames = look(truth, flat, 0, 1);
    Calibration other = truth;
    for (CalibratedCamera& one : other.cameras) {
      auto& lens = std::get<BrownLens>(one.camera.model.lens);
      lens.cx_px += shift(random);
      lens.cy_px += shift(random);
    }
    const auto right = measure_target(truth, board(), frames);
    const auto wrong = measure_target(other, board(), frames);
    for (std::size_t k = 0; k < right->points_in_world.size(); ++k, ++points)
      sum += (wrong->points_in_world[k] - right->points_in_world[k]).squaredNorm();
  }
  // 60 draws of six numbers: the standard deviation of the scatter is about 1 / sqrt(2 x 180).
  EXPECT_NEAR(std::sqrt(sum / points), predicted, 0.2 * predicted);
  EXPECT_GT(coach.now().calibration_m, predicted);
}

TEST(Coach, ProposesAPoseThatTwoCamerasSeeAndThatHelps) {
  const Calibration calibration = rig_of_three();
  const Coach coach(calibration, board(), volume(), {0.05, 0.05, 0.05});
  const auto next = coach.next();
  ASSERT_TRUE(next.has_value());
  EXPECT_GE(next->cameras.size(), 2U);
  EXPECT_LT(next->calibration_m, coach.now().calibration_m);
  EXPECT_GT(next->calibration_m, 0);
  ASSERT_EQ(next->outline_px.size(), next->cameras.size());
  for (const auto& outline : next->outline_px)
    for (const Eigen::Vector2d& px : outline) {
      EXPECT_GE(px.minCoeff(), 0);
      EXPECT_LE(px.x(), 1279);
      EXPECT_LE(px.y(), 1023);
    }
  EXPECT_THAT(next->words, testing::HasSubstr("tilted by"));
}

TEST(Coach, APerfectCalibrationNeedsNoPose) {
  Calibration calibration = rig_of_three();
  calibration.joint_covariance.setZero();
  const Coach coach(calibration, board(), volume(), {0.05, 0.05, 0.05});
  EXPECT_EQ(coach.now().calibration_m, 0);
  EXPECT_FALSE(coach.next().has_value());
}

TEST(Coach, SaysWhatItLacks) {
  Calibration calibration = rig_of_three();
  calibration.joint_covariance.resize(0, 0);
  EXPECT_THROW(Coach(calibration, board(), volume(), {1, 1, 1}), Error);
  EXPECT_THROW(Coach(rig_of_three(), board(), {{5, 5, 0}, {6, 6, 1}}, {1, 1, 1}), Error);
}

}  // namespace
}  // namespace drape::console
