// SPDX-License-Identifier: Apache-2.0
#include "console/cameras.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace drape::console {
namespace {

/// A board of dots of 7 px on grey, displaced by some px, as a preview shows it: edges to a part
/// of a pixel, noise of a grey level.
std::vector<unsigned char> board(double x_px, double y_px, double light = 1) {
  constexpr int kWidth = 533, kHeight = 400, kPitch_px = 40, kShift = 4;
  cv::Mat image(kHeight, kWidth, CV_8UC1, cv::Scalar(60 * light));
  const auto fixed = [](double px) { return static_cast<int>(std::lround(px * (1 << kShift))); };
  cv::rectangle(image, {fixed(90 + x_px), fixed(70 + y_px)}, {fixed(450 + x_px), fixed(330 + y_px)},
                cv::Scalar(200 * light), cv::FILLED, cv::LINE_AA, kShift);
  for (int row = 0; row < 6; ++row)
    for (int col = 0; col < 8; ++col)
      cv::circle(image, {fixed(130 + kPitch_px * col + x_px), fixed(100 + kPitch_px * row + y_px)},
                 fixed(3.5), cv::Scalar(20 * light), cv::FILLED, cv::LINE_AA, kShift);
  static cv::RNG random(1);
  cv::Mat noise(image.size(), CV_16SC1), noisy;
  random.fill(noise, cv::RNG::NORMAL, 0, 1);
  image.convertTo(noisy, CV_16SC1);
  noisy += noise;
  noisy.convertTo(image, CV_8UC1);
  std::vector<unsigned char> bytes;
  cv::imencode(".pgm", image, bytes);
  return bytes;
}

/// Three cameras at 5 Hz.
class HeldBoard : public testing::Test {
 protected:
  /// Sets that were due within the time; the board goes by so many px from picture to picture in
  /// the first `moving` views.
  int due_within(double time_s, double step_px, int moving = 3) {
    int due = 0;
    for (const double end_s = at_s_ + time_s; at_s_ < end_s; at_s_ += 0.2)
      for (int camera = 0; camera < 3; ++camera) {
        double& x = x_px_[camera];
        if (camera < moving) x += step_px;
        watch_.see("cam" + std::to_string(camera), board(x, 0.3 * x, light_), at_s_);
        if (watch_.is_due(at_s_)) ++due;
      }
    return due;
  }

  StillWatch watch_{{"cam0", "cam1", "cam2"}};
  double at_s_ = 100, light_ = 1;
  double x_px_[3] = {0, 0, 0};
};

TEST_F(HeldBoard, IsTakenOnceWhereItIsStillAndAgainWhereItIsNew) {
  EXPECT_EQ(due_within(2, 3), 0) << "it moves";
  EXPECT_EQ(due_within(3, 0), 1);
  EXPECT_EQ(due_within(5, 0), 0) << "the same pose";
  EXPECT_EQ(due_within(1, 4), 0);
  EXPECT_EQ(due_within(3, 0), 1) << "20 px beside";
}

TEST_F(HeldBoard, IsStillWhereTheLightFlickers) {
  for (int k = 0, due = 0; k < 10; ++k) {
    light_ = k % 2 == 0 ? 1 : 0.97;
    due += due_within(0.2, 0);
    if (k == 9) {
      EXPECT_EQ(due, 1);
    }
  }
}

TEST_F(HeldBoard, ATremorIsNoNewPose) {
  EXPECT_EQ(due_within(3, 0), 1);
  EXPECT_EQ(due_within(0.4, 0.5), 0);
  EXPECT_EQ(due_within(3, 0), 0) << "one pixel of the picture beside";
}

TEST_F(HeldBoard, ADriftIsNotStill) {
  EXPECT_EQ(due_within(4, 0.3), 0);
}

TEST_F(HeldBoard, OneViewIsNotEnough) {
  EXPECT_EQ(due_within(3, 0), 1);
  EXPECT_EQ(due_within(1, 5, 1), 0);
  EXPECT_EQ(due_within(3, 0), 0) << "one camera alone sees the new place";
}

TEST_F(HeldBoard, IsTakenAgainWhereTheSetWasRefused) {
  EXPECT_EQ(due_within(3, 0), 1);
  watch_.forget_last_set();
  EXPECT_EQ(due_within(3, 0), 1);
}

TEST_F(HeldBoard, ACameraWithoutPicturesHoldsTheSetBack) {
  for (int k = 0; k < 20; ++k, at_s_ += 0.2) {
    watch_.see("cam0", board(0, 0), at_s_);
    watch_.see("cam1", board(0, 0), at_s_);
    EXPECT_FALSE(watch_.is_due(at_s_));
  }
  const std::vector<unsigned char> broken = {'P', '5', '\n'};
  watch_.see("cam2", broken, at_s_);
  watch_.see("other", board(0, 0), at_s_);
  EXPECT_FALSE(watch_.is_due(at_s_));
}

}  // namespace
}  // namespace drape::console
