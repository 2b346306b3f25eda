// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/record.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/error.hpp"
#include "tests/support/paths.hpp"

namespace drape::capture {
namespace {

GreyView view(const cv::Mat& image) {
  return {{image.data, image.total()}, image.cols, image.rows};
}

cv::Mat frame(const std::string& set, int camera) {
  return cv::imread(
      (test::source_root() / fmt::format("rigs/bench1/recording/{}/cam{}.png", set, camera))
          .string(),
      cv::IMREAD_UNCHANGED);
}

/// The picture with added Gaussian noise.
cv::Mat noisy(const cv::Mat& image, int seed, double noise_grey) {
  cv::Mat result, noise(image.size(), CV_16S);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(noise, cv::RNG::NORMAL, 0, noise_grey);
  image.convertTo(result, CV_16S);
  result += noise;
  result.convertTo(result, CV_8U);
  return result;
}

/// The picture rotated and shifted, with its own noise.
cv::Mat moved(const cv::Mat& image, double dx, double dy, double turn_rad = 0, int seed = 1,
              double noise_grey = 2) {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  const double mid_x = 0.5 * image.cols, mid_y = 0.5 * image.rows;
  const cv::Mat map = (cv::Mat_<double>(2, 3) << c, -s, mid_x - c * mid_x + s * mid_y + dx, s, c,
                       mid_y - s * mid_x - c * mid_y + dy);
  cv::Mat result;
  cv::warpAffine(image, result, map, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return noisy(result, seed, noise_grey);
}

MotionResult motion_between(const cv::Mat& first, const cv::Mat& second) {
  return BlockFollower(view(first), {}).motion_to(view(second));
}

/// The pattern of Aravis's fake camera: a ramp along the diagonal, from white back to black.
cv::Mat ramp(int at, double noise_grey, int seed) {
  cv::Mat image(512, 512, CV_8U);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(20 + (x + y + at) % 200);
  return noisy(image, seed, noise_grey);
}

StillReport look_at(const std::vector<cv::Mat>& images) {
  CamerasFile cameras;
  cameras.cameras.emplace_back().name = "cam0";
  LiveResult live;
  for (const cv::Mat& image : images) {
    PairedFrames& set = live.pairing.sets.emplace_back();
    set.frames = {live.frames.size()};
    live.frames.push_back(
        {{}, image.cols, image.rows, "", {image.data, image.data + image.total()}});
  }
  return look_still(live, cameras, {});
}

TEST(Motion, WhatMovesAcrossTheOnlyEdgesIsMovedAndWhatCannotBeJudgedIsNamed) {
  for (const double noise : {0.0, 1.0, 4.0}) {
    for (const int at : {1, 2, 3, 5, 40}) {
      const StillReport moving = look_at({ramp(0, noise, 1), ramp(at, noise, 2)});
      EXPECT_TRUE(moving.cloth_moved) << at << " of noise " << noise;
      EXPECT_LT(moving.motion_px.value_or(0), at / std::sqrt(2.0) + 0.1) << "the least it moved";
      EXPECT_TRUE(moving.not_judged().empty());
    }
    for (int seed = 2; seed < 12; ++seed) {
      const StillReport still = look_at({ramp(0, noise, 1), ramp(0, noise, seed)});
      EXPECT_FALSE(still.cloth_moved) << "noise " << noise;
      EXPECT_EQ(still.not_judged(), std::vector<std::string>{"cam0"}) << "it may move along them";
    }
  }
  const cv::Mat grey(512, 512, CV_8U, cv::Scalar(90));
  EXPECT_EQ(look_at({grey, grey}).not_judged(), std::vector<std::string>{"cam0"});
  EXPECT_TRUE(look_at({grey}).not_judged().empty()) << "one frame is no burst";
  const cv::Mat cloth = frame("drape_A", 0);
  EXPECT_TRUE(look_at({cloth, moved(cloth, 0, 0)}).not_judged().empty());
}

TEST(Motion, ABurstOfAStillClothIsStillAndOneThatMovesIsNot) {
  const cv::Mat first = frame("drape_A", 0);
  for (const double shift : {0.0, 0.1, 0.5, 1.5}) {
    const MotionResult motion = motion_between(first, moved(first, shift, 0));
    EXPECT_GT(motion.blocks.size(), 60U) << shift;
    EXPECT_LT(motion.lost, motion.textured / 10) << shift;
    EXPECT_NEAR(motion.largest_px(), shift, 0.03 + 0.03 * shift);
  }
}

TEST(Motion, ACornerOfTheClothThatMovesAloneIsSeen) {
  const cv::Mat first = frame("drape_A", 0);
  cv::Mat second = moved(first, 0, 0);
  const cv::Rect corner(640, 800, 200, 200);
  moved(first, 0.4, 0.3)(corner).copyTo(second(corner));
  EXPECT_NEAR(motion_between(first, second).largest_px(), 0.5, 0.06);
}

/// A corner that swings out of range covers less than a tenth of the blocks; noise is not motion.
TEST(Motion, ACornerThatSwingsFarIsSeenAndNoiseIsNot) {
  for (const char* set : {"drape_A", "drape_C"}) {
    for (const double noise : {0.0, 2.0, 4.0, 7.0}) {
      const cv::Mat first = moved(frame(set, 0), 0, 0, 0, 1, noise);
      const MotionResult still = motion_between(first, moved(frame(set, 0), 0, 0, 0, 2, noise));
      EXPECT_FALSE(still.is_lost()) << set << " " << noise << ": " << still.gone;
      EXPECT_LT(still.largest_px(), StillOptions{}.largest_motion_px) << set << " " << noise;
    }
  }
  const cv::Mat drape = frame("drape_A", 0);
  for (const double noise : {0.0, 2.0, 4.0})
    for (const double swing : {4.0, 30.0}) {
      cv::Mat second = drape.clone();
      const cv::Rect corner(640, 800, 100, 100);
      moved(drape, swing, 0.5 * swing, 0, 2, 0)(corner).copyTo(second(corner));
      const MotionResult motion =
          motion_between(moved(drape, 0, 0, 0, 1, noise), moved(second, 0, 0, 0, 2, noise));
      EXPECT_TRUE(motion.is_lost()) << swing << " " << noise;
    }
}

/// A picture of a scene with read-out noise and photon noise, whose variance is proportional to the
/// grey level.
cv::Mat taken(const cv::Mat& scene, int seed, double read_grey, double variance_per_grey) {
  cv::Mat grey, sd, noise(scene.size(), CV_32F), result;
  scene.convertTo(grey, CV_32F);
  cv::sqrt(grey * variance_per_grey + read_grey * read_grey, sd);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(noise, cv::RNG::NORMAL, 0, 1);
  cv::Mat(grey + noise.mul(sd)).convertTo(result, CV_8U);
  return result;
}

/// Waves of `period_px` along both axes.
cv::Mat waves(cv::Size size, double mean_grey, double amplitude_grey, double period_px) {
  cv::Mat scene(size, CV_32F);
  const double turn = 2 * CV_PI / period_px;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      scene.at<float>(y, x) = static_cast<float>(
          mean_grey + amplitude_grey * (std::sin(turn * x) + std::sin(turn * y)));
  return scene;
}

/// A few bright blocks of faint weave on a dark bench: their noise differs from that of the others.
TEST(Motion, NoiseThatGrowsWithTheLightIsNoMotion) {
  cv::Mat scene(480, 640, CV_32F), cells(80, 107, CV_8U);
  cv::RNG random(5);
  random.fill(cells, cv::RNG::UNIFORM, 0, 2);
  for (int y = 0; y < scene.rows; ++y)
    for (int x = 0; x < scene.cols; ++x)
      scene.at<float>(y, x) = cells.at<std::uint8_t>(y / 6, x / 6) != 0 ? 35.0F : 15.0F;
  waves({98, 98}, 200, 4.5, 8).copyTo(scene(cv::Rect(144, 144, 98, 98)));
  const cv::Mat first = taken(scene, 1, 0.7, 0.05);
  int lost = 0;
  for (int seed = 2; seed < 10; ++seed) {
    const MotionResult motion = motion_between(first, taken(scene, seed, 0.7, 0.05));
    EXPECT_FALSE(motion.is_lost()) << motion.gone;
    lost += motion.lost;
  }
  EXPECT_GT(lost, 0) << "or the weave is not faint";
  const cv::Mat drape = frame("drape_A", 0), still = taken(drape, 1, 0.7, 0.05);
  EXPECT_FALSE(motion_between(still, taken(drape, 2, 0.7, 0.05)).is_lost());
  cv::Mat swung = drape.clone();
  const cv::Rect corner(640, 800, 100, 100);
  moved(drape, 30, 15, 0, 2, 0)(corner).copyTo(swung(corner));
  EXPECT_TRUE(motion_between(still, taken(swung, 2, 0.7, 0.05)).is_lost());
}

/// A reference hidden by noise is refused itself, instead of every set compared with it.
TEST(Motion, AReferenceIsAcceptedOnlyWhereItIsFoundAgain) {
  int accepted = 0;
  for (const double amplitude_grey : {0.1, 0.5, 0.7, 0.8, 0.9, 1.0, 1.5, 3.0}) {
    const cv::Mat scene = waves({640, 480}, 120, amplitude_grey, 32);
    const cv::Mat empty = taken(scene, 1, 2, 0);
    const Background background(view(empty));
    if (!background.is_textured()) continue;
    ++accepted;
    for (int seed = 2; seed < 6; ++seed) {
      const cv::Mat now = taken(scene, seed, 2, 0);
      EXPECT_TRUE(background.shift_px(view(now))) << amplitude_grey;
    }
  }
  EXPECT_EQ(accepted, 2) << "amplitudes of 1.5 and 3";
}

TEST(Motion, ACameraThatMovedIsSeenByTheTableBehindTheCloth) {
  for (int camera = 0; camera < 3; ++camera) {
    const Background empty(view(frame("empty", camera)));
    const cv::Mat drape = frame("drape_A", camera);
    const auto still = empty.shift_px(view(drape));
    ASSERT_TRUE(still);
    EXPECT_LT(*still, StillOptions{}.largest_shift_px) << camera;
    const auto shifted = empty.shift_px(view(moved(drape, 0.9, -1.2)));
    ASSERT_TRUE(shifted);
    EXPECT_NEAR(*shifted, 1.5, 0.25) << camera;
    // A rotation by 2 mrad about the axis: 1 px at half the distance to the corners.
    const auto turned = empty.shift_px(view(moved(drape, 0, 0, 2e-3)));
    ASSERT_TRUE(turned);
    EXPECT_GT(*turned, StillOptions{}.largest_shift_px) << camera;
    std::printf("cam%d: background shift %.3f px; shifted by 1.5 px: %.3f; turned: %.3f\n", camera,
                *still, *shifted, *turned);
  }
}

/// A camera knocked by any distance must not pass: it is found near the truth or not at all.
TEST(Motion, ACameraKnockedByAnyDistanceIsNeverInItsPlace) {
  const Background empty(view(frame("empty", 0)));
  const cv::Mat drape = frame("drape_A", 0);
  for (const double shift : {1.0, 3.0, 10.0, 13.0, 16.0, 24.0, 40.0, 100.0, 400.0}) {
    for (const auto& [dx, dy] : {std::pair{shift, 0.0}, {0.0, -shift}}) {
      const auto found = empty.shift_px(view(moved(drape, dx, dy)));
      if (found) {
        EXPECT_NEAR(*found, shift, StillOptions{}.largest_shift_px);
      }
      EXPECT_EQ(found.has_value(), shift < empty.reach_px()) << shift;
    }
  }
  EXPECT_FALSE(empty.shift_px(view(frame("drape_A", 1)))) << "another camera's picture";
}

/// Cloths and targets cover up to three quarters of bench1's pictures; here up to nine tenths.
TEST(Motion, WhatIsLeftOfTheTableTellsThatTheCameraIsInPlace) {
  for (int camera = 0; camera < 3; ++camera) {
    const Background empty(view(frame("empty", camera)));
    const double limit_px = StillOptions{}.largest_shift_px;
    for (const char* set : {"empty", "drape_C", "drape_E", "pose_00", "pose_05", "stage_z090"})
      EXPECT_LT(empty.shift_px(view(frame(set, camera))).value_or(99), limit_px)
          << set << " " << camera;
    cv::Mat covered = frame("empty", camera).clone();
    cv::RNG random(7);
    cv::Mat cloth = covered(cv::Rect(160, 0, covered.cols - 160, covered.rows));
    random.fill(cloth, cv::RNG::UNIFORM, 60, 200);
    EXPECT_LT(empty.shift_px(view(covered)).value_or(99), limit_px) << camera;
    EXPECT_GT(empty.shift_px(view(moved(covered, 2, 0))).value_or(99), limit_px) << camera;
  }
}

TEST(Motion, ASmallPictureIsFollowedInSmallerBlocks) {
  for (const int width : {800, 640, 320}) {
    cv::Mat empty;
    cv::resize(frame("empty", 1), empty, {width, width * 3 / 4}, 0, 0, cv::INTER_AREA);
    const Background background(view(empty));
    ASSERT_TRUE(background.is_textured());
    const double limit_px = StillOptions{}.largest_shift_px;
    EXPECT_LT(background.shift_px(view(moved(empty, 0, 0))).value(), limit_px);
    EXPECT_NEAR(background.shift_px(view(moved(empty, 1.5, 0))).value(), 1.5, limit_px);
    for (const int far : {16, 24, 40, 100})
      EXPECT_FALSE(background.shift_px(view(moved(empty, far, 0)))) << far;
  }
}

TEST(Motion, ABackgroundWithoutTextureTellsNothing) {
  const cv::Mat flat(480, 640, CV_8U, cv::Scalar(90));
  EXPECT_FALSE(Background(view(flat)).is_textured());
  EXPECT_FALSE(Background(view(flat)).shift_px(view(flat)));
  const cv::Mat other(240, 320, CV_8U, cv::Scalar(90));
  EXPECT_THROW(static_cast<void>(motion_between(flat, other)), Error);
  EXPECT_FALSE(Background(view(frame("empty", 0))).shift_px(view(flat))) << "of another size";
}

}  // namespace
}  // namespace drape::capture
