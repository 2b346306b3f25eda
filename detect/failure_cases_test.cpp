// SPDX-License-Identifier: Apache-2.0
// What goes wrong on a bench: each case ends in right labels or in a rejection that is named, never
// in a wrong label.
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

TEST(FailureCases, NothingWrongWithAPlainView) {
  const Print print = small_print();
  const Look look = look_at(ClothPicture(print, {}), print);
  EXPECT_EQ(look.right, all);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_LT(look.worst_px, 0.12);
}

TEST(FailureCases, OneHiddenDotCostsOneDot) {
  const Print print = small_print();
  ClothPicture picture(print, {});
  picture.wipe(picture.place_mm({2, 3}), 3);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.right, all - 1);
  EXPECT_EQ(look.wrong, 0);
}

TEST(FailureCases, ADotHalfHiddenByAFoldIsNotMeasured) {
  // The cloth turns away just beyond the middle of column 2's dots, and comes back.
  const Print print = small_print();
  ClothView view;
  view.slope_rad = [](double s) { return s > 50.5 && s < 58 ? 100 * deg : 0.0; };
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.wrong, 0);
  for (const Detection& dot : look.frame.detections) EXPECT_NE(dot.mark.col, 2);
  EXPECT_GE(look.right, 2 * side);
}

TEST(FailureCases, AFoldThatHidesExactlyOneColumnShiftsNoLabel) {
  // The layer from 53 mm on lies over what goes before it: column 2 is hidden, and column 1 is seen
  // where column 2 would be. The tags on either side name it differently.
  const Print print = small_print();
  ClothView view;
  view.slope_rad = [](double s) { return s > 43 && s < 53 ? 180 * deg : 0.0; };
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_EQ(look.right, 4 * side);
  EXPECT_THAT(reason_at(look.frame, *picture.seen_px({2, 1})), HasSubstr("no label"));
}

TEST(FailureCases, TwoLayersWhoseDotsRunOnAcrossTheEdgeStayApart) {
  // Folded back by exactly one pitch: behind the edge the lattice goes on as if nothing were there.
  const Print print = small_print();
  int labels = 0, visible = 0, wrong = 0;
  for (const double back : {9.0, 10.0, 11.0, 20.0}) {
    for (int at = 41; at < 70; at += 5) {
      ClothView view;
      view.turn_rad = at / 10.0;
      view.px_per_mm = 3.7;
      view.width_px = view.height_px = 640;
      view.slope_rad = [=](double s) { return s > at && s < at + back ? 180 * deg : 0.0; };
      const Look look = look_at(ClothPicture(print, view), print);
      labels += look.right + look.wrong;
      visible += look.visible;
      wrong += look.wrong;
      EXPECT_EQ(look.wrong, 0) << back << " mm back at " << at << " mm";
    }
  }
  std::cout << visible << " visible dots, " << labels << " labels, " << wrong << " wrong\n";
  EXPECT_GE(labels, 0.7 * visible);
}

TEST(FailureCases, AMirroredImageAndTheBackAreNotLabelled) {
  const Print print = small_print();
  const ClothPicture picture(print, {});
  GreyImage image = picture.draw();
  cv::Mat whole(image.height_px, image.width_px, CV_8U, image.bytes.data());
  cv::flip(whole, whole, 1);
  const FrameDetections frame = detected(image, print);
  EXPECT_TRUE(frame.detections.empty());
  EXPECT_TRUE(frame.tags.empty());
}

TEST(FailureCases, AHalfCoveredTagIsMissedWithoutHarm) {
  const Print print = small_print();
  ClothPicture picture(print, {});
  picture.wipe(picture.place_mm({2, 2}) + Eigen::Vector2d(14, 10), 5);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.frame.tags.size(), print.tags.size() - 1);
  EXPECT_EQ(look.right, all);
  EXPECT_EQ(look.wrong, 0);
}

TEST(FailureCases, AMirroredTagIsNotRead) {
  const Print print = small_print();
  ClothPicture picture(print, {});
  picture.mirror(picture.place_mm({2, 2}) + Eigen::Vector2d(10, 10), 6.5);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.frame.tags.size(), print.tags.size() - 1);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_EQ(look.right, all);
}

TEST(FailureCases, APatchUpsideDownOrAskewIsTheSamePatch) {
  const Print print = small_print();
  for (const double turn : {90.0, 180.0, 217.0}) {
    ClothView view;
    view.turn_rad = turn * deg;
    view.px_per_mm = 3.9;
    const ClothPicture picture(print, view);
    const Look look = look_at(picture, print);
    EXPECT_EQ(look.right, all) << turn;
    EXPECT_EQ(look.wrong, 0) << turn;
  }
}

TEST(FailureCases, AHighlightOnADotSaturatesIt) {
  const Print print = small_print();
  ClothView view;
  const Eigen::Vector2d at = *ClothPicture(print, view).seen_px({3, 3});
  view.light = [at](double u, double v) {
    const double r2 = (Eigen::Vector2d(u, v) - at - Eigen::Vector2d(8, 0)).squaredNorm();
    return 1 + 4 * std::exp(-r2 / 100);
  };
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_FALSE(has(look.frame, {3, 3}));
  EXPECT_THAT(reason_at(look.frame, at),
              AnyOf(HasSubstr("saturated"), HasSubstr("partly"), HasSubstr("bad fit")));
  EXPECT_GE(look.right, all - 2);
}

TEST(FailureCases, AShadowsEdgeThroughADotIsRightOrNamed) {
  const Print print = small_print();
  ClothView view;
  const Eigen::Vector2d at = *ClothPicture(print, view).seen_px({2, 3});
  view.light = [at](double u, double) { return u < at.x() + 2 ? 0.55 : 1.0; };
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_GE(look.right, all - side);
  // Those that are measured although the edge runs through them are not far off.
  EXPECT_LT(look.worst_px, 0.2);
}

TEST(FailureCases, WeaveMoireChangesNoLabel) {
  const Print print = small_print();
  ClothView view;
  view.light = [](double u, double v) {
    return 1 + 0.06 * std::sin(1.7 * u) * std::sin(1.9 * v) + 0.04 * std::sin(0.23 * u + 0.1 * v);
  };
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.right, all);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_LT(look.worst_px, 0.3);
}

TEST(FailureCases, DotsCutByTheImageBorderAreNotMeasured) {
  const Print print = small_print();
  ClothView view;
  view.width_px = 494;  // the outer columns' middles lie on the border
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_EQ(look.right, all - 2 * side);
}

TEST(FailureCases, NarrowEllipsesAreRightUntilTheyAreTooSmall) {
  const Print print = small_print();
  for (const double squeeze : {0.5, 0.3, 0.2, 0.12}) {
    ClothView view;
    view.squeeze = squeeze;
    const ClothPicture picture(print, view);
    const Look look = look_at(picture, print);
    std::cout << "minor axis " << 20 * squeeze << " px: " << look.right << " of " << all
              << " right, worst " << look.worst_px << " px\n";
    EXPECT_EQ(look.wrong, 0) << squeeze;
    if (squeeze >= 0.3) {
      EXPECT_EQ(look.right, all) << squeeze;
    }
    EXPECT_EQ(look.right + static_cast<int>(look.frame.islands.size()) +
                      static_cast<int>(look.frame.rejections.size()) >=
                  (squeeze >= 0.2 ? all : 0),
              true);
  }
}

TEST(FailureCases, BlurFromATenthToTwoPixels) {
  const Print print = small_print();
  for (const double blur : {0.3, 1.0, 1.5, 2.0}) {
    ClothView view;
    view.blur_px = blur;
    const ClothPicture picture(print, view);
    const Look look = look_at(picture, print);
    EXPECT_EQ(look.right, all) << blur;
    EXPECT_EQ(look.wrong, 0) << blur;
    EXPECT_LT(look.worst_px, 0.12) << blur;
  }
}

TEST(FailureCases, ASaturatedClothIsRefusedByName) {
  const Print print = small_print();
  ClothView view;
  view.bright = 300;
  view.dark = 60;
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.right + look.wrong, 0);
  EXPECT_THAT(reason_at(look.frame, *picture.seen_px({2, 2})), HasSubstr("saturated"));
}

}  // namespace
}  // namespace drape::test
