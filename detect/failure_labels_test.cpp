// SPDX-License-Identifier: Apache-2.0
// What goes wrong on a bench with labels: dirt, other patches, other prints, no tags, islands.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/units.hpp"
#include "detect/test_views.hpp"

namespace drape::test {

using namespace detect;

namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using units::deg;
using units::mm;

TEST(FailureCases, DirtThatLooksLikeDotsGetsNoLabel) {
  const Print print = small_print();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(8, 112);
  ClothPicture picture(print, {});
  for (int k = 0; k < 12; ++k) {
    Eigen::Vector2d at;
    double nearest = 0;
    do {  // in a bare cell, clear of dots
      at = {place(random), place(random)};
      nearest = 1e9;
      for (int m = 0; m < all; ++m) {
        nearest = std::min(nearest, (picture.place_mm({m / side, m % side}) - at).norm());
      }
      const int row = static_cast<int>((at.y() - 10) / 20),
                col = static_cast<int>((at.x() - 10) / 20);
      if ((row + col) % 2 == 0) nearest = 0;
    } while (nearest < 6);
    picture.stain(at, 2);
  }
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_GE(look.right, all - 2);
}

TEST(FailureCases, TwoPatchesWithTheSameTagsAreNotMixed) {
  const Print print = small_print();
  ClothView view;
  view.width_px = 560;
  view.px_per_mm = 4;
  const ClothPicture picture(print, view);
  const GreyImage one = picture.draw();
  const cv::Mat left(one.height_px, one.width_px, CV_8U,
                     const_cast<std::uint8_t*>(one.bytes.data()));
  cv::Mat both;
  cv::hconcat(left, left, both);
  GreyImage image{both.cols, both.rows, {}, {}};
  image.bytes.assign(both.datastart, both.dataend);
  const FrameDetections frame = detected(image, print);
  EXPECT_TRUE(frame.detections.empty()) << "every tag is seen twice: neither can be trusted";
  EXPECT_GE(frame.islands.size(), 2U * all - 8);
}

TEST(FailureCases, AWrongPrintFileLabelsNothing) {
  const Print print = small_print();
  const ClothPicture picture(print, {});
  Print other = print;
  for (PrintedTag& tag : other.tags) tag.id += 100;
  const FrameDetections frame = detected(picture.draw(), other);
  EXPECT_TRUE(frame.detections.empty());
  EXPECT_TRUE(frame.tags.empty());
}

TEST(FailureCases, AnEmptyImageIsEmpty) {
  for (const int level : {0, 100, 255}) {
    const std::size_t pixels = 400 * 300;
    const GreyImage image{
        400, 300, std::vector<std::uint8_t>(pixels, static_cast<std::uint8_t>(level)), {}};
    const FrameDetections frame = detected(image, small_print());
    EXPECT_TRUE(frame.detections.empty());
    EXPECT_TRUE(frame.islands.empty());
    EXPECT_TRUE(frame.rejections.empty());
  }
}

TEST(FailureCases, SixteenBitsAndABayerMosaic) {
  const Print print = small_print();
  const ClothPicture picture(print, {});
  const GreyImage plain = picture.draw();
  GreyImage deep = plain;
  for (const std::uint8_t byte : plain.bytes) deep.levels.push_back(byte);
  const Look look = judged(detected(deep, print), picture);
  EXPECT_EQ(look.right, all);
  // A colour sensor's mosaic read as grey: red and blue sites see less of the lamp than green ones.
  GreyImage mosaic = plain;
  for (int v = 0; v < plain.height_px; ++v) {
    for (int u = 0; u < plain.width_px; ++u) {
      const double gain = (u + v) % 2 == 0 ? 1.0 : (v % 2 == 0 ? 0.8 : 0.7);
      auto& byte = mosaic.bytes[static_cast<std::size_t>(v) * plain.width_px + u];
      byte = static_cast<std::uint8_t>(std::lround(gain * byte));
    }
  }
  const Look patterned = judged(detected(mosaic, print), picture);
  std::cout << "Bayer mosaic as grey: " << patterned.right << " right, worst " << patterned.worst_px
            << " px\n";
  EXPECT_EQ(patterned.wrong, 0);
  EXPECT_GE(patterned.right + static_cast<int>(patterned.frame.rejections.size()), all);
  EXPECT_LT(patterned.worst_px, 0.2);
}

TEST(FailureCases, WithoutTagsTheClassesOfTheDotsTell) {
  const Print print = small_print(true, false);
  ClothView view;
  view.turn_rad = 130 * deg;
  view.px_per_mm = 4;
  ClothPicture picture(print, view);
  picture.wipe(picture.place_mm({0, 0}), 3);
  picture.wipe(picture.place_mm({3, 4}), 3);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.right, all - 2);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_LT(look.worst_px, 0.15);
}

TEST(FailureCases, ClassesAndTagsTogether) {
  const Print print = small_print(true, true);
  const ClothPicture picture(print, {});
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.right, all);
  EXPECT_EQ(look.wrong, 0);
  // The same cloth described with other classes contradicts itself: nothing is guessed.
  Print other = small_print(false, true);
  other.dot_classes =
      DotClasses{1.6 * mm, {"oo#o##", "#ooo#o", "##o#oo", "#o##o#", "##o#oo", "o###o#"}};
  const Look contradicted = judged(detected(picture.draw(), other), picture);
  EXPECT_LT(contradicted.right, all);
}

TEST(FailureCases, WithoutTagsOrClassesThePieceIsAnIsland) {
  const Print print = small_print(false, false);
  const ClothPicture picture(print, {});
  const FrameDetections frame = detected(picture.draw(), print);
  EXPECT_TRUE(frame.detections.empty());
  EXPECT_EQ(frame.islands.size(), static_cast<std::size_t>(all));
}

TEST(FailureCases, PiecesOfAFlatPlateAreOneIsland) {
  // A plain grid without its outer column cannot be placed; a missing column cuts it in two.
  const Print print = small_print(false, false);
  ClothPicture picture(print, {});
  for (int row = 0; row < side; ++row) {
    picture.wipe(picture.place_mm({row, 0}), 3);
    picture.wipe(picture.place_mm({row, 3}), 3);
  }
  PrintPlane plane = plane_of(print);
  plane.stiff = true;
  TagFinder finder(print.tag_family);
  const FrameDetections frame =
      detect_frame(picture.draw(), plane, finder, limits_of(DetectOptions{}));
  EXPECT_TRUE(frame.detections.empty());
  EXPECT_EQ(frame.islands.size(), 4U * side);
  for (const IslandDot& dot : frame.islands) EXPECT_EQ(dot.island, 0);
}

TEST(FailureCases, AllTagsOnOneSideOfARidge) {
  const Print print = small_print();
  ClothView view;
  view.slope_rad = [](double s) { return s < 55 ? 45 * deg : (s < 65 ? 0.0 : -45 * deg); };
  ClothPicture picture(print, view);
  for (const PrintedTag& tag : print.tags) {
    if (tag.centre_m.y() > 50 * mm) {
      picture.wipe({tag.centre_m.y() / mm, tag.centre_m.x() / mm}, 3.5);
    }
  }
  const Look look = look_at(picture, print);
  std::cout << "beyond a ridge: " << look.right << " of " << look.visible << " right, "
            << look.frame.islands.size() << " in islands\n";
  EXPECT_EQ(look.wrong, 0);
  EXPECT_EQ(
      look.right + static_cast<int>(look.frame.islands.size() + look.frame.rejections.size()) >=
          look.visible - 2,
      true);
}

TEST(FailureCases, BarrelDistortion) {
  const Print print = small_print();
  ClothView view;
  view.kappa_per_px2 = 0.25 / (700.0 * 700.0);
  view.px_per_mm = 5.5;
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.right, all);
  EXPECT_EQ(look.wrong, 0);
}

}  // namespace
}  // namespace drape::test
