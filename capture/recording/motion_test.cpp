// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/motion.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/recording/still.hpp"
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

/// The picture turned and shifted, with noise of its own.
cv::Mat moved(const cv::Mat& image, double dx, double dy, double turn_rad = 0, int seed = 1) {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  const double mid_x = 0.5 * image.cols, mid_y = 0.5 * image.rows;
  const cv::Mat map = (cv::Mat_<double>(2, 3) << c, -s, mid_x - c * mid_x + s * mid_y + dx, s, c,
                       mid_y - s * mid_x - c * mid_y + dy);
  cv::Mat result, noise(image.size(), CV_16S);
  cv::warpAffine(image, result, map, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(noise, cv::RNG::NORMAL, 0, 2);
  result.convertTo(result, CV_16S);
  result += noise;
  result.convertTo(result, CV_8U);
  return result;
}

TEST(Motion, ABurstOfAStillClothIsStillAndOneThatMovesIsNot) {
  const cv::Mat first = frame("drape_A", 0);
  for (const double shift : {0.0, 0.1, 0.5, 1.5}) {
    const MotionResult motion = block_motion(view(first), view(moved(first, shift, 0)), {});
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
  EXPECT_NEAR(block_motion(view(first), view(second), {}).largest_px(), 0.5, 0.06);
}

TEST(Motion, ACameraThatMovedIsSeenByTheTableBehindTheCloth) {
  for (int camera = 0; camera < 3; ++camera) {
    const cv::Mat empty = frame("empty", camera), drape = frame("drape_A", camera);
    const auto still = background_shift_px(view(empty), view(drape));
    ASSERT_TRUE(still);
    EXPECT_LT(*still, StillOptions{}.largest_shift_px) << camera;
    const auto shifted = background_shift_px(view(empty), view(moved(drape, 0.9, -1.2)));
    ASSERT_TRUE(shifted);
    EXPECT_NEAR(*shifted, 1.5, 0.25) << camera;
    // A turn of 2 mrad about the axis: 1 px at half the distance to the corners.
    const auto turned = background_shift_px(view(empty), view(moved(drape, 0, 0, 2e-3)));
    ASSERT_TRUE(turned);
    EXPECT_GT(*turned, StillOptions{}.largest_shift_px) << camera;
    std::printf("cam%d: background shift %.3f px; shifted by 1.5 px: %.3f; turned: %.3f\n", camera,
                *still, *shifted, *turned);
  }
}

TEST(Motion, ABackgroundWithoutTextureTellsNothing) {
  const cv::Mat flat(480, 640, CV_8U, cv::Scalar(90));
  EXPECT_FALSE(background_shift_px(view(flat), view(flat)));
  const cv::Mat other(240, 320, CV_8U, cv::Scalar(90));
  EXPECT_THROW(static_cast<void>(block_motion(view(flat), view(other), {})), Error);
}

}  // namespace
}  // namespace drape::capture
