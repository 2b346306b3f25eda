// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/board.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <opencv2/core.hpp>
#include <random>
#include <tuple>

#include "core/geometry/vectors.hpp"
#include "core/scene.hpp"
#include "detect/test_pictures.hpp"
#include "tests/support/trials.hpp"

namespace drape::detect {
namespace {

Target board(int rows, int cols) {
  Target target;
  target.kind = TargetKind::chessboard;
  target.rows = rows;
  target.cols = cols;
  target.pitch_m = 1;
  return target;
}

/// Picture of a board whose corner (row, col) is at image_from_board (col, row, 1): dark between
/// the corners (0, 0) and (1, 1), sampled 8 x 8 per pixel, with noise of 2 grey levels.
GreyImage picture_of(const Target& target, const Eigen::Matrix3d& image_from_board,
                     int width_px = 640, int height_px = 480) {
  const Eigen::Matrix3d board_from_image = image_from_board.inverse();
  const auto level = [&](const Eigen::Vector2d& px) {
    const Eigen::Vector2d place = mapped(board_from_image, px);
    const int col = static_cast<int>(std::floor(place.x()));
    const int row = static_cast<int>(std::floor(place.y()));
    const bool on_board = col >= -1 && row >= -1 && col < target.cols && row < target.rows;
    return on_board && (row + col) % 2 == 0 ? 40.0 : 200.0;
  };
  return test::exposed(test::sampled(width_px, height_px, 8, level), 0, 2, 7);
}

/// Columns to the right and rows up, rotated by `angle_deg`, with perspective.
Eigen::Matrix3d view(double angle_deg, double pitch_px) {
  const double angle = angle_deg * std::acos(-1.0) / 180;
  Eigen::Matrix3d centred = Eigen::Matrix3d::Identity();
  centred.topRightCorner<2, 1>() << -4, -2.5;
  Eigen::Matrix3d scaled;
  scaled << pitch_px * std::cos(angle), pitch_px * std::sin(angle), 320.3,  //
      pitch_px * std::sin(angle), -pitch_px * std::cos(angle), 240.7,       //
      0.0, 0.0, 1.0;
  Eigen::Matrix3d tilted = Eigen::Matrix3d::Identity();
  tilted(2, 0) = 0.02;
  return scaled * tilted * centred;
}

/// The view in a picture of half the size, which OpenCV searches in a quarter of the time.
Eigen::Matrix3d halved(const Eigen::Matrix3d& image_from_board) {
  return Eigen::Vector3d(0.5, 0.5, 1).asDiagonal() * image_from_board;
}

GreyImage small_picture_of(const Target& target, const Eigen::Matrix3d& image_from_board) {
  return picture_of(target, image_from_board, 320, 240);
}

Eigen::Vector2d error_px(const Detection& corner, const Eigen::Matrix3d& image_from_board) {
  return corner.centre_px - mapped(image_from_board, {corner.mark.col, corner.mark.row});
}

double rms_error_px(const FrameDetections& frame, const Eigen::Matrix3d& image_from_board) {
  double squares = 0;
  for (const Detection& corner : frame.detections)
    squares += error_px(corner, image_from_board).squaredNorm();
  return std::sqrt(squares / static_cast<double>(frame.detections.size()));
}

/// Squared error along an axis in units of the stated variance.
double normalised(const Detection& corner, const Eigen::Matrix3d& image_from_board) {
  const Eigen::Vector2d error = error_px(corner, image_from_board);
  return error.dot(corner.covariance_px2.inverse() * error) / 2;
}

TEST(Chessboard, CornersKeepTheirLabelsHoweverTheBoardIsTurned) {
  const Target target = board(6, 9);
  for (const double angle_deg : {0.0, 35.0, 90.0, 180.0, 250.0}) {
    const Eigen::Matrix3d image_from_board = view(angle_deg, 36);
    const FrameDetections frame = detect_chessboard(picture_of(target, image_from_board), target);
    ASSERT_EQ(frame.detections.size(), 54U) << angle_deg;
    // A wrong label is off by one square, 30 px or more.
    EXPECT_LT(rms_error_px(frame, image_from_board), 0.1) << angle_deg;
  }
}

TEST(Chessboard, TheStatedUncertaintyIsThatOfTheErrors) {
  const Target target = board(6, 9);
  double sum = 0;
  int corners = 0;
  for (const double angle_deg : {3.0, 20.0, 41.0, 75.0}) {
    const Eigen::Matrix3d image_from_board = view(angle_deg, 30);
    const FrameDetections frame = detect_chessboard(picture_of(target, image_from_board), target);
    for (const Detection& corner : frame.detections) {
      sum += normalised(corner, image_from_board);
      ++corners;
    }
  }
  ASSERT_EQ(corners, 4 * 54);
  // Mean of 216 values with expectation 1; the scale is estimated from some 80 differences a frame.
  EXPECT_NEAR(sum / corners, 1, 0.5);
}

Eigen::Matrix3d shifted(Eigen::Matrix3d image_from_board, double right_px, double down_px) {
  image_from_board.row(0) += right_px * image_from_board.row(2);
  image_from_board.row(1) += down_px * image_from_board.row(2);
  return image_from_board;
}

TEST(Chessboard, ThePartOfACutOffBoardKeepsItsLabels) {
  const Target target = board(6, 9);
  // Columns are cut off on both sides, upright and upside down.
  for (const double angle_deg : {0.0, 180.0}) {
    for (const double right_px : {250.0, -250.0}) {
      const Eigen::Matrix3d image_from_board = halved(shifted(view(angle_deg, 36), right_px, 0));
      const FrameDetections frame =
          detect_chessboard(small_picture_of(target, image_from_board), target);
      EXPECT_GE(frame.detections.size(), 24U) << angle_deg << " " << right_px;
      EXPECT_LT(frame.detections.size(), 54U);
      EXPECT_LT(rms_error_px(frame, image_from_board), 0.1) << angle_deg << " " << right_px;
    }
  }
}

// The window of a corner at the picture's edge shrinks, and its stated uncertainty grows.
TEST(Chessboard, NoCornerIsLeftOutAtThePicturesEdge) {
  const Target target = board(6, 9);
  double sum = 0;
  int corners = 0;
  for (const double left_px : {5.2, 6.7, 7.9, 9.4}) {
    Eigen::Matrix3d turned = halved(view(3, 50));
    turned(2, 0) = turned(2, 1) = 0;  // no perspective
    turned /= turned(2, 2);
    double first_px = 320;
    for (const int row : {0, 5}) first_px = std::min(first_px, mapped(turned, {0, row}).x());
    const Eigen::Matrix3d image_from_board = shifted(turned, left_px - first_px, 0);
    const FrameDetections frame =
        detect_chessboard(small_picture_of(target, image_from_board), target);
    EXPECT_EQ(frame.detections.size(), 54U) << left_px;
    for (const Detection& corner : frame.detections) {
      if (corner.mark.col > 0) continue;
      sum += normalised(corner, image_from_board);
      ++corners;
    }
  }
  ASSERT_EQ(corners, 4 * 6);
  // Mean of 48 values with expectation 1: 3 standard deviations, the scale known to a sixth.
  EXPECT_LT(sum / corners, 1.8);
  EXPECT_GT(sum / corners, 0.4);
}

TEST(Chessboard, APartWhosePlaceIsInDoubtIsRefusedByName) {
  const Target target = board(6, 9);
  // Neither end of the columns is visible.
  const FrameDetections frame =
      detect_chessboard(small_picture_of(target, halved(view(0, 100))), target);
  EXPECT_TRUE(frame.detections.empty());
  ASSERT_EQ(frame.rejections.size(), 1U);
  EXPECT_THAT(frame.rejections[0].reason, testing::HasSubstr("no part of it whose place"));
}

// Counting squares instead of corners gives one row and one column too many.
TEST(Chessboard, SquaresCountedForCornersAreNamed) {
  const int cases = test::trial_count(4, 200);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> turn(0, 360), size(17, 23), off(-15, 15);
  std::uniform_int_distribution<int> rows(4, 7), cols(5, 8);
  for (int i = 0; i < cases; ++i) {
    const Target printed = board(rows(random), cols(random));
    const Target stated = board(printed.rows + 1, printed.cols + 1);
    Eigen::Matrix3d centred = Eigen::Matrix3d::Identity();
    centred(0, 2) = 4 - (printed.cols - 1) / 2.0;
    centred(1, 2) = 2.5 - (printed.rows - 1) / 2.0;
    const Eigen::Matrix3d image_from_board =
        shifted(halved(view(turn(random), 1.6 * size(random))), off(random), off(random)) * centred;
    const FrameDetections frame =
        detect_chessboard(small_picture_of(printed, image_from_board), stated);
    EXPECT_TRUE(frame.detections.empty()) << i << ": " << printed.rows << " x " << printed.cols
                                          << ", " << frame.detections.size() << " corners";
    ASSERT_EQ(frame.rejections.size(), 1U) << i;
    EXPECT_THAT(frame.rejections[0].reason, testing::HasSubstr("squares counted for corners")) << i;
  }
}

TEST(Chessboard, ABoardOfFourByThreeCornersIsRead) {
  const Target small = board(3, 4);
  const Eigen::Matrix3d map = halved(view(20, 60));
  const FrameDetections frame = detect_chessboard(small_picture_of(small, map), small);
  ASSERT_EQ(frame.detections.size(), 12U);
  EXPECT_LT(rms_error_px(frame, map), 0.1);
}

TEST(Chessboard, NoBoardIsSeenInNoise) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(128, 40);
  for (const double blur_px : {0.0, 2.0, 6.0}) {
    const cv::Mat light = test::sampled(480, 360, 1, [&](const Eigen::Vector2d&) {
      return 128 + (noise(random) - 128) * (1 + 2 * blur_px);
    });
    const GreyImage image = test::exposed(light, blur_px, 0, 1);
    EXPECT_TRUE(detect_chessboard(image, board(3, 4)).detections.empty()) << blur_px;
    EXPECT_TRUE(detect_chessboard(image, board(3, 3)).detections.empty()) << blur_px;
  }
}

#if defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(Chessboard, PicturesOfTwoMegapixelsWithoutABoardTakeBelowTwoSeconds) {
  cv::setNumThreads(1);
  std::mt19937 random(3);
  // A dark picture with noise, and blocks of noise, on which the search for quadrangles is slowest.
  for (const auto& [block_px, mean, spread] :
       {std::tuple(1, 8, 5), std::tuple(1, 128, 60), std::tuple(4, 128, 120)}) {
    GreyImage image{1600, 1200, std::vector<std::uint8_t>(1600 * 1200), {}};
    std::uniform_int_distribution<int> level(mean - spread, mean + spread);
    std::vector<std::uint8_t> row(1600);
    for (int y = 0; y < 1200; ++y) {
      if (y % block_px == 0)
        for (int x = 0; x < 1600; ++x)
          row[x] = x % block_px == 0 ? static_cast<std::uint8_t>(level(random)) : row[x - 1];
      std::copy(row.begin(), row.end(), image.bytes.begin() + 1600 * y);
    }
    const std::clock_t start = std::clock();
    EXPECT_TRUE(detect_chessboard(image, board(6, 9)).detections.empty());
    EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 2.0)
        << block_px << ", " << mean;
  }
}
#endif

TEST(Chessboard, KnowsWhenItsSidesLookAlike) {
  EXPECT_FALSE(is_ambiguous(board(6, 9)));
  EXPECT_TRUE(is_ambiguous(board(6, 8)));
}

}  // namespace
}  // namespace drape::detect
