// SPDX-License-Identifier: Apache-2.0
#include "console/console.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <random>

#include "core/geometry/next_pose.hpp"

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

WorldBox volume() {
  return {{-0.1, -0.1, 0}, {0.1, 0.1, 0.1}};
}

/// Detections of the board, with Gaussian noise.
std::vector<FrameDetections> look(const Calibration& calibration, const WorldFromTarget& pose,
                                  double sigma_px, unsigned seed, const Target& target = board()) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, sigma_px);
  std::vector<FrameDetections> frames;
  for (const CalibratedCamera& one : calibration.cameras) {
    FrameDetections frame;
    frame.camera = one.camera.name;
    for (int row = 0; row < target.rows; ++row)
      for (int col = 0; col < target.cols; ++col) {
        const auto image =
            project(one.camera.model,
                    one.camera.cam_from_world * (pose * target.point_in_target({row, col})));
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
  const PosePlanner coach(calibration, points_of(board()), volume(), {0.05, 0.05, 0.05});
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

/// The point whose images are nearest to those that were seen, in px, as sheets are measured.
Vector3d nearest_in_images(const Calibration& calibration,
                           const std::vector<FrameDetections>& frames, std::size_t mark,
                           Vector3d point) {
  for (int step = 0; step < 5; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    for (std::size_t c = 0; c < frames.size(); ++c) {
      const Camera& camera = calibration.cameras[c].camera;
      const auto image = project(camera.model, camera.cam_from_world * point);
      const Eigen::Matrix<double, 2, 3> d = image->d_px_d_point * camera.cam_from_world.rotation;
      normal += d.transpose() * d;
      right += d.transpose() * (frames[c].detections[mark].centre_px - image->px);
    }
    point += normal.inverse() * right;
  }
  return point;
}

TEST(Coach, PredictsTheScatterThatRandomCalibrationsHave) {
  const Calibration truth = rig_of_three();
  const PosePlanner coach(truth, points_of(board()), volume(), {0.05, 0.05, 0.05});
  // Only image centres vary: their effect on a triangulated point is found by doing it.
  Calibration known = truth;
  known.joint_covariance.setZero();
  for (const Eigen::Index camera : {0, 1, 2})
    for (const Eigen::Index k : {2, 3})
      known.joint_covariance(15 * camera + k, 15 * camera + k) = 0.04;
  const double predicted =
      PosePlanner(known, points_of(board()), volume(), {0.05, 0.05, 0.05}).now().calibration_m;
  std::mt19937 random(7);
  std::normal_distribution<double> shift(0, 0.2);
  Target corners;  // corners of the volume and points between them, at three heights
  corners.rows = corners.cols = 3;
  corners.pitch_m = 0.1;
  double sum = 0;
  constexpr int kTrials = 60, kPoints = 27;
  for (int trial = 0; trial < kTrials; ++trial) {
    Calibration other = truth;
    for (CalibratedCamera& one : other.cameras) {
      auto& lens = std::get<BrownLens>(one.camera.model.lens);
      lens.cx_px += shift(random);
      lens.cy_px += shift(random);
    }
    Eigen::Matrix3Xd right(3, kPoints), wrong(3, kPoints);
    for (int k = 0; k < kPoints; k += 9) {
      WorldFromTarget flat;
      flat.translation_m = {0, 0, 0.05 * k / 9};
      const auto frames = look(truth, flat, 0, 1, corners);
      for (int i = 0; i < 9; ++i) {
        right.col(k + i) = flat * corners.point_in_target({i / 3, i % 3});
        wrong.col(k + i) =
            nearest_in_images(other, frames, static_cast<std::size_t>(i), right.col(k + i));
      }
    }
    const Eigen::Matrix4d move = Eigen::umeyama(wrong, right, false);
    sum += ((move.topLeftCorner<3, 3>() * wrong).colwise() + Vector3d(move.topRightCorner<3, 1>()) -
            right)
               .squaredNorm();
  }
  // 60 draws of six numbers: the standard deviation of the scatter is about 1 / sqrt(2 x 180).
  EXPECT_NEAR(std::sqrt(sum / (kTrials * kPoints)), predicted, 0.2 * predicted);
  EXPECT_GT(coach.now().calibration_m, predicted);
}

TEST(Coach, ProposesAPoseThatTwoCamerasSeeAndThatHelps) {
  const Calibration calibration = rig_of_three();
  const PosePlanner coach(calibration, points_of(board()), volume(), {0.05, 0.05, 0.05});
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
  const PosePlanner coach(calibration, points_of(board()), volume(), {0.05, 0.05, 0.05});
  EXPECT_EQ(coach.now().calibration_m, 0);
  EXPECT_FALSE(coach.next().has_value());
}

TEST(Coach, SaysWhatItLacks) {
  Calibration calibration = rig_of_three();
  calibration.joint_covariance.resize(0, 0);
  EXPECT_THROW(PosePlanner(calibration, points_of(board()), volume(), {1, 1, 1}), Error);
  const PosePlanner blind(rig_of_three(), points_of(board()), {{5, 5, 0}, {6, 6, 1}}, {1, 1, 1});
  EXPECT_FALSE(blind.sees_volume());
  EXPECT_FALSE(blind.next());
}

}  // namespace
}  // namespace drape::console
