// SPDX-License-Identifier: Apache-2.0
// Failures of a bench: each case must end in right labels or in a rejection with its reason, never
// in a wrong label.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <iostream>
#include <opencv2/core.hpp>
#include <ostream>
#include <set>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "detect/test_pictures.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {

using namespace detect;

namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using units::deg;
using units::mm;

/// A view of the small print that must lose no label, or only given ones, and have no wrong one.
struct View {
  const char* name;
  ClothView view = {};
  void (*spoil)(ClothPicture&) = [](ClothPicture&) {};
  int right = all;
  double worst_px = 2;
  std::size_t lost_tags = 0;
};

void PrintTo(const View& view, std::ostream* out) {
  *out << view.name;
}

ClothView blurred(double blur_px) {
  ClothView view;
  view.blur_px = blur_px;
  return view;
}

ClothView turned(double turn_deg) {
  ClothView view;
  view.turn_rad = turn_deg * deg;
  view.px_per_mm = 3.9;
  return view;
}

ClothView moire() {
  ClothView view;
  view.light = [](double u, double v) {
    return 1 + 0.06 * std::sin(1.7 * u) * std::sin(1.9 * v) + 0.04 * std::sin(0.23 * u + 0.1 * v);
  };
  return view;
}

ClothView barrel() {
  ClothView view;
  view.kappa_per_px2 = 0.25 / (700.0 * 700.0);
  view.px_per_mm = 5.5;
  return view;
}

class FailureViews : public testing::TestWithParam<View> {};

TEST_P(FailureViews, LabelsAreRightOrMissing) {
  const Print print = small_print();
  ClothPicture picture(print, GetParam().view);
  GetParam().spoil(picture);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.right, GetParam().right);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_LT(look.worst_px, GetParam().worst_px);
  if (GetParam().lost_tags > 0) {
    EXPECT_EQ(look.frame.tags.size(), print.tags.size() - GetParam().lost_tags);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, FailureViews,
    testing::Values(
        View{.name = "Plain", .worst_px = 0.12},
        View{.name = "OneHiddenDot",
             .spoil =
                 [](ClothPicture& p) {
                   p.wipe(p.place_mm({2, 3}), 3);
                 },
             .right = all - 1},
        View{.name = "HalfCoveredTag",
             .spoil =
                 [](ClothPicture& p) {
                   p.wipe(p.place_mm({2, 2}) + Eigen::Vector2d(14, 10), 5);
                 },
             .lost_tags = 1},
        View{.name = "MirroredTag",
             .spoil =
                 [](ClothPicture& p) {
                   p.mirror(p.place_mm({2, 2}) + Eigen::Vector2d(10, 10), 6.5);
                 },
             .lost_tags = 1},
        View{.name = "QuarterTurn", .view = turned(90)},
        View{.name = "HalfTurn", .view = turned(180)}, View{.name = "Askew", .view = turned(217)},
        View{.name = "WeaveMoire", .view = moire(), .worst_px = 0.3},
        // The centres of the outer columns are on the border.
        View{.name = "CutByTheBorder", .view = {.width_px = 494}, .right = all - 2 * side},
        View{.name = "Sharp", .view = blurred(0.3), .worst_px = 0.12},
        View{.name = "Blur1", .view = blurred(1), .worst_px = 0.12},
        View{.name = "Blur15", .view = blurred(1.5), .worst_px = 0.12},
        View{.name = "Blur2", .view = blurred(2), .worst_px = 0.12},
        View{.name = "BarrelDistortion", .view = barrel()}),
    [](const auto& view) { return std::string(view.param.name); });

class FailureCases : public testing::Test {
 protected:
  Print print = small_print();
  ClothView view;
};

TEST_F(FailureCases, ADotHalfHiddenByAFoldIsNotMeasured) {
  // The cloth turns away just beyond the centre of column 2's dots, and returns.
  view.slope_rad = [](double s) { return s > 50.5 && s < 58 ? 100 * deg : 0.0; };
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.wrong, 0);
  for (const Detection& dot : look.frame.detections) EXPECT_NE(dot.mark.col, 2);
  EXPECT_GE(look.right, 2 * side);
}

TEST_F(FailureCases, AFoldThatHidesExactlyOneColumnShiftsNoLabel) {
  // The layer beyond 53 mm covers the part before it: column 2 is hidden, and column 1 is seen
  // where column 2 would be. The tags on either side label it differently.
  view.slope_rad = [](double s) { return s > 43 && s < 53 ? 180 * deg : 0.0; };
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_EQ(look.right, 4 * side);
  EXPECT_THAT(reason_at(look.frame, *picture.seen_px({2, 1})), HasSubstr("no label"));
}

TEST_F(FailureCases, TwoLayersWhoseDotsRunOnAcrossTheEdgeStayApart) {
  // Folded back by exactly one pitch: behind the edge the lattice seems to continue undisturbed.
  int labels = 0, visible = 0, wrong = 0;
  for (const double back : {9.0, 10.0, 11.0, 20.0}) {
    for (int at = 41; at < 70; at += 5) {
      view = {};
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

TEST_F(FailureCases, AMirroredImageAndTheBackAreNotLabelled) {
  const FrameDetections frame = detected(mirrored(ClothPicture(print, {}).draw()), print);
  EXPECT_TRUE(frame.detections.empty());
  EXPECT_TRUE(frame.tags.empty());
}

TEST_F(FailureCases, AHighlightOnADotSaturatesIt) {
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

TEST_F(FailureCases, AShadowsEdgeThroughADotIsRightOrNamed) {
  const Eigen::Vector2d at = *ClothPicture(print, view).seen_px({2, 3});
  view.light = [at](double u, double) { return u < at.x() + 2 ? 0.55 : 1.0; };
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.wrong, 0);
  EXPECT_GE(look.right, all - side);
  // Dots that the edge cuts are measured with small errors.
  EXPECT_LT(look.worst_px, 0.2);
}

TEST_F(FailureCases, NarrowEllipsesAreRightUntilTheyAreTooSmall) {
  for (const double squeeze : {0.5, 0.3, 0.2, 0.12}) {
    view = {};
    view.squeeze = squeeze;
    const Look look = look_at(ClothPicture(print, view), print);
    std::cout << "minor axis " << 20 * squeeze << " px: " << look.right << " of " << all
              << " right, worst " << look.worst_px << " px\n";
    EXPECT_EQ(look.wrong, 0) << squeeze;
    if (squeeze >= 0.3) {
      EXPECT_EQ(look.right, all) << squeeze;
    }
    if (squeeze >= 0.2) {
      EXPECT_GE(look.right + look.frame.islands.size() + look.frame.rejections.size(), 1U * all);
    }
  }
}

TEST_F(FailureCases, ASaturatedClothIsRefusedByName) {
  view.bright = 300;
  view.dark = 60;
  const ClothPicture picture(print, view);
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.right + look.wrong, 0);
  EXPECT_THAT(reason_at(look.frame, *picture.seen_px({2, 2})), HasSubstr("saturated"));
}

TEST_F(FailureCases, DirtThatLooksLikeDotsGetsNoLabel) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(8, 112);
  ClothPicture picture(print, {});
  for (int k = 0; k < 12; ++k) {
    Eigen::Vector2d at;
    double nearest = 0;
    do {  // within a bare cell, clear of dots
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

TEST_F(FailureCases, TwoPatchesWithTheSameTagsAreNotMixed) {
  view.width_px = 560;
  view.px_per_mm = 4;
  const ClothPicture picture(print, view);
  const GreyImage one = picture.draw();
  cv::Mat both;
  cv::hconcat(view_of(one), view_of(one), both);
  const FrameDetections frame = detected(image_of(both), print);
  EXPECT_TRUE(frame.detections.empty()) << "every tag is seen twice: neither can be trusted";
  EXPECT_GE(frame.islands.size(), 2U * all - 8);
}

TEST_F(FailureCases, AWrongPrintFileLabelsNothing) {
  const ClothPicture picture(print, {});
  Print other = print;
  for (PrintedTag& tag : other.tags) tag.id += 100;
  const FrameDetections frame = detected(picture.draw(), other);
  EXPECT_TRUE(frame.detections.empty());
  EXPECT_TRUE(frame.tags.empty());
}

TEST_F(FailureCases, AnEmptyImageHasNoMarks) {
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

TEST_F(FailureCases, SixteenBitsAndABayerMosaicAreRead) {
  const ClothPicture picture(print, {});
  const GreyImage plain = picture.draw();
  GreyImage deep = plain;
  for (const std::uint8_t byte : plain.bytes) deep.levels.push_back(byte);
  const Look look = judged(detected(deep, print), picture);
  EXPECT_EQ(look.right, all);
  // A colour sensor's mosaic read as grey: red and blue sites get less light than green ones.
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

TEST_F(FailureCases, WithoutTagsTheClassesOfTheDotsTell) {
  print = small_print(true, false);
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

TEST_F(FailureCases, ClassesAndTagsTogetherLabelEveryDot) {
  print = small_print(true, true);
  const ClothPicture picture(print, {});
  const Look look = look_at(picture, print);
  EXPECT_EQ(look.right, all);
  EXPECT_EQ(look.wrong, 0);
  // The same cloth described with other classes is inconsistent: no label is guessed.
  Print other = small_print(false, true);
  other.dot_classes =
      DotClasses{1.6 * mm, {"oo#o##", "#ooo#o", "##o#oo", "#o##o#", "##o#oo", "o###o#"}};
  const Look contradicted = judged(detected(picture.draw(), other), picture);
  EXPECT_LT(contradicted.right, all);
}

TEST_F(FailureCases, WithoutTagsOrClassesThePieceIsAnIsland) {
  print = small_print(false, false);
  const ClothPicture picture(print, {});
  const FrameDetections frame = detected(picture.draw(), print);
  EXPECT_TRUE(frame.detections.empty());
  EXPECT_EQ(frame.islands.size(), static_cast<std::size_t>(all));
}

TEST_F(FailureCases, PiecesOfAFlatPlateAreOneIsland) {
  // A plain grid without its outer column cannot be located; a missing column divides it in two.
  print = small_print(false, false);
  ClothPicture picture(print, {});
  for (int row = 0; row < side; ++row) {
    picture.wipe(picture.place_mm({row, 0}), 3);
    picture.wipe(picture.place_mm({row, 3}), 3);
  }
  PrintPlane plane = plane_of(print);
  plane.stiff = true;
  TagFinder finder(print.tag_family);
  const FrameDetections frame = detect_frame(picture.draw(), plane, finder, {});
  EXPECT_TRUE(frame.detections.empty());
  EXPECT_EQ(frame.islands.size(), 4U * side);
  for (const IslandDot& dot : frame.islands) EXPECT_EQ(dot.island, 0);
}

TEST_F(FailureCases, AllTagsOnOneSideOfARidgeLabelNothingWrongly) {
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
  EXPECT_GE(look.right + static_cast<int>(look.frame.islands.size() + look.frame.rejections.size()),
            look.visible - 2);
}

// ----
// Views that lose marks are reported with the reason: light, sharpness, or another print.

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

GreyImage picture_of(const ClothView& view) {
  return ClothPicture(small_print(), view).draw();
}

FrameDetections frame_of(const GreyImage& image, const Print& print, const std::string& camera,
                         double* blur_px = nullptr) {
  FrameDetections frame = detected(image, print, blur_px);
  frame.set = "drape_C";
  frame.camera = camera;
  return frame;
}

/// Sentences about a set of three views of which `view` is the last.
std::vector<std::string> said_of(const ClothView& view) {
  std::vector<FrameDetections> frames;
  std::vector<PictureQuality> qualities;
  for (const auto& [camera, one] :
       {std::pair{"cam0", ClothView{}}, std::pair{"cam1", ClothView{}}, std::pair{"cam2", view}}) {
    const GreyImage image = picture_of(one);
    frames.push_back(frame_of(image, small_print(), camera));
    qualities.push_back(quality_of(image));
  }
  return poor_views(frames, qualities);
}

/// One flat and one tilted picture of dots of 4 mm.
std::vector<GreyImage> two_views(double px_per_mm, double blur_px) {
  std::vector<GreyImage> pictures;
  for (const double squeeze : {1.0, 0.8}) {
    ClothView view;
    view.squeeze = squeeze;
    view.px_per_mm = px_per_mm;
    view.blur_px = blur_px;
    pictures.push_back(picture_of(view));
  }
  return pictures;
}

/// Size ratio and sentence if the dots' diameter is stated so and the first rows and columns are
/// labelled.
std::pair<std::optional<double>, std::string> size_of(const std::vector<GreyImage>& pictures,
                                                      double stated_mm, int labelled = side) {
  Print stated = small_print();
  stated.dot_diameter_m = stated_mm * mm;
  std::vector<FrameDetections> frames;
  std::vector<double> blurs_px;
  for (const GreyImage& picture : pictures) {
    frames.push_back(frame_of(picture, stated, "cam0", &blurs_px.emplace_back()));
    std::erase_if(frames.back().detections, [&](const Detection& dot) {
      return dot.mark.row >= labelled || dot.mark.col >= labelled;
    });
  }
  const MarkLattice lattice{Surface::cloth,        side,           side, stated.pitch_m,
                            stated.dot_diameter_m, stated.patch_m, {},   {}};
  const auto ratio = dot_size_ratio(frames, blurs_px, lattice);
  return {ratio, other_dot_size(ratio, lattice, "print.toml")};
}

TEST(DotSize, IsMeasuredAndAnotherOneIsNamed) {
  const std::vector<GreyImage> sharp = two_views(4.93, 0.6);
  const auto [ratio, none] = size_of(sharp, 4);
  ASSERT_TRUE(ratio);
  EXPECT_NEAR(*ratio, 1, 0.01);
  EXPECT_THAT(none, IsEmpty());
  EXPECT_THAT(size_of(sharp, 3.8).second, IsEmpty());
  for (const double stated_mm : {3.0, 3.5, 4.5, 5.5})
    EXPECT_THAT(size_of(sharp, stated_mm).second,
                AllOf(HasSubstr("the dots are "), HasSubstr("dot_diameter_mm in print.toml is")))
        << stated_mm;
  // With one neighbour along each axis few dots can be measured: 8 of these 32 have four.
  const auto few = size_of(sharp, 4, 4).first;
  ASSERT_TRUE(few);
  EXPECT_NEAR(*few, 1, 0.01);
  for (const double stated_mm : {3.5, 4.5})
    EXPECT_THAT(size_of(sharp, stated_mm, 4).second, HasSubstr("the dots are ")) << stated_mm;
  EXPECT_FALSE(size_of(sharp, 4, 3).first) << "18 dots";
}

TEST(DotSize, IsNotMistakenForDefocus) {
  const std::vector<GreyImage> blurred = two_views(3.41, 2.5);
  const auto [ratio, none] = size_of(blurred, 4);
  ASSERT_TRUE(ratio);
  EXPECT_NEAR(*ratio, 1, 0.02) << "0.90 without the part that blur takes";
  EXPECT_THAT(none, IsEmpty());
  EXPECT_THAT(size_of(blurred, 3.5).second, HasSubstr("the dots are "));
}

TEST(PictureQuality, EightBitsAreCountedAsTheirLevelsAreSorted) {
  const GreyImage counted = picture_of({});
  GreyImage sorted = counted;
  for (const std::uint8_t byte : counted.bytes) sorted.levels.push_back(byte);
  const PictureQuality a = quality_of(counted), b = quality_of(sorted);
  EXPECT_EQ(a.dark, b.dark);
  EXPECT_EQ(a.light, b.light);
  EXPECT_EQ(a.edge_px, b.edge_px);
  EXPECT_GT(a.light, a.dark);
}

TEST(PictureQuality, ADimViewIsNamedWithTheMarksItCosts) {
  ClothView dim;
  dim.bright = 8;
  dim.dark = 5;
  const auto said = said_of(dim);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_THAT(said[0], AllOf(HasSubstr("set drape_C: camera cam2 is dim: its grey levels are"),
                             HasSubstr("the best view of the set 36")));
}

TEST(PictureQuality, PicturesThatAllLeaveTheirLevelsUnusedAreNamed) {
  const GreyImage good = picture_of({});
  GreyImage low = good;
  for (std::uint8_t& byte : low.bytes) {
    low.levels.push_back(static_cast<float>(byte) / 16);
    byte = static_cast<std::uint8_t>(byte / 16);
  }
  FrameDetections frame;
  frame.set = "drape_C";
  frame.camera = "cam0";
  const PictureQuality dark = quality_of(low);
  try {
    (void)unused_levels({frame, frame}, {dark, dark});
    FAIL() << "12 bits were taken for 16";
  } catch (const Error& error) {
    EXPECT_EQ(error.where().camera, "cam0");
    EXPECT_THAT(error.what(), AllOf(HasSubstr("as in 1 more"), HasSubstr("by 16")));
  }
  low.levels.clear();
  EXPECT_THAT(unused_levels({frame}, {quality_of(low)}),
              AllOf(HasSubstr("camera cam0: hardly"), Not(HasSubstr("by 16"))));
  EXPECT_EQ(unused_levels({frame}, {quality_of(good)}), "");
}

TEST(PictureQuality, ABlurredViewIsNamedWithTheMarksItCosts) {
  ClothView blurred;
  blurred.blur_px = 9;
  const auto said = said_of(blurred);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_THAT(said[0], AllOf(HasSubstr("camera cam2 is blurred: its sharpest edges are"),
                             HasSubstr("shows 0 marks")));
}

TEST(PictureQuality, AViewOfFewMarksInGoodLightIsNotAccused) {
  EXPECT_THAT(said_of({}), IsEmpty());
  ClothView steep;
  steep.squeeze = 0.12;
  EXPECT_THAT(said_of(steep), IsEmpty());
}

TEST(PictureQuality, TheEdgeWidthIsThatOfTheBlur) {
  for (const double blur_px : {1.5, 3.0}) {
    ClothView view;
    view.blur_px = blur_px;
    EXPECT_NEAR(quality_of(picture_of(view)).edge_px, blur_px, 0.2 * blur_px);
  }
}

std::string why(const GreyImage& image, const Print& print) {
  return why_no_mark(image, plane_of(print), {}, false, "print.toml");
}

TEST(PictureQuality, APictureWithoutMarksTellsWhichPrintItShows) {
  const GreyImage image = picture_of({});
  Print other = small_print();
  other.tag_family = "tag25h9";
  EXPECT_THAT(why(image, other), AllOf(HasSubstr("of tag36h11"), HasSubstr("tags.family"),
                                       HasSubstr("print.toml is tag25h9")));
  other = small_print();
  for (PrintedTag& tag : other.tags) tag.id += 100;
  EXPECT_THAT(why(image, other),
              AllOf(HasSubstr("shows tags 0 to 12"), HasSubstr("tags.first_id")));
  other = small_print();
  other.dot_diameter_m = 2 * mm;
  EXPECT_THAT(why(image, other),
              HasSubstr("dot_diameter_mm in print.toml is 2: is it the radius?"));
  EXPECT_THAT(why(mirrored(image), small_print()), HasSubstr("mirrored"));
}

std::string elsewhere(const std::function<void(std::vector<PrintedTag>&)>& mistake) {
  static const std::vector<TagDetection> seen =
      frame_of(picture_of({}), small_print(), "cam0").tags;
  Print print = small_print();
  mistake(print.tags);
  return tags_elsewhere(plane_of(print), seen, "print.toml", "tags.first_id, tags.cells");
}

TEST(TagPlaces, WhatThePrintHasElsewhereIsNamed) {
  EXPECT_EQ(elsewhere([](auto&) {}), "");
  EXPECT_THAT(elsewhere([](auto& tags) {
                for (std::size_t k = 0; k < tags.size(); ++k)
                  tags[k].id = static_cast<int>((k + 1) % tags.size());
              }),
              AllOf(HasSubstr("tags lie elsewhere on the print"), HasSubstr("tags.first_id"),
                    HasSubstr("mm apart at least, print.toml has them")));
  EXPECT_THAT(elsewhere([](auto& tags) {
                for (PrintedTag& tag : tags) std::swap(tag.centre_m.x(), tag.centre_m.y());
              }),
              HasSubstr("are rows and columns, or the sign of an axis, exchanged"));
  EXPECT_THAT(elsewhere([](auto& tags) {
                for (PrintedTag& tag : tags)
                  tag.centre_m = Eigen::Vector2d(0.12, 0.12) - tag.centre_m;
              }),
              HasSubstr("in other directions"));
  EXPECT_THAT(elsewhere([](auto& tags) { std::swap(tags[0].centre_m, tags[12].centre_m); }),
              HasSubstr("2 of 13 tags lie elsewhere"));
  EXPECT_EQ(elsewhere([](auto& tags) { tags[0].centre_m += Eigen::Vector2d(0.05, 0.05); }), "")
      << "one tag may be misread";
}

TEST(TagSize, IsMeasuredAndAnotherOneIsNamed) {
  const std::vector<TagDetection> seen = frame_of(picture_of({}), small_print(), "cam0").tags;
  const auto why = [&](double factor) {
    Print print = small_print();
    print.tag_edge_m *= factor;
    return other_tag_size(plane_of(print), seen, "print.toml");
  };
  for (const double factor : {0.93, 1.0, 1.07}) EXPECT_EQ(why(factor), "") << factor;
  for (const double factor : {0.7, 0.87, 1.15, 1.4})
    EXPECT_THAT(why(factor),
                AllOf(HasSubstr("the tags are "), HasSubstr("tags.edge_mm in print.toml")))
        << factor;
  Print print = small_print();
  print.tag_edge_m = 9 * mm;
  EXPECT_EQ(other_tag_size(plane_of(print), {seen.begin(), seen.begin() + 5}, "print.toml"), "")
      << "five tags";
}

// ----
// drape-detect refuses unwritable output before reading a frame.

namespace fs = std::filesystem;

TEST(Places, AreRefusedBeforeAFrameIsLookedAt) {
  const TemporaryFolder folder;
  const fs::path rig = source_root() / "rigs/bench1", recording = folder.path() / "recording";
  const fs::path file = folder.path() / "a.txt", good = folder.path() / "out.json";
  fs::create_directories(folder.path() / "folder.json");
  fs::create_directories(recording / "drape_A");
  write_durable(file, "a file");
  write_durable(recording / "recording.json", read_text(rig / "recording/recording.json"));
  const auto run = [&](const fs::path& out, const fs::path& overlay) {
    return run_line(fmt::format("{} {} --rig {} --surface cloth --sets drape_A --quiet --out {}{}",
                                program("drape-detect").string(), recording.string(), rig.string(),
                                out.string(),
                                overlay.empty() ? "" : " --overlay " + overlay.string()));
  };
  // The pictures do not exist, so the message that names one shows that it was read first.
  EXPECT_THAT(run(good, {}).text, HasSubstr("drape_A/cam0.png"));
  EXPECT_THAT(run(folder.path() / "folder.json", {}).text, HasSubstr("a folder, link or device"));
  EXPECT_THAT(run(file / "out.json", {}).text, HasSubstr("a.txt"));
  EXPECT_THAT(run(good, file).text, HasSubstr("a file stands where a folder"));
  for (const char* name : {"out.json", "drape_A/cam1.png", "new/out.json", "../recording/out.json"})
    EXPECT_THAT(run(recording / name, {}).text, HasSubstr("lies inside the recording")) << name;
  EXPECT_THAT(run(good, recording).text, HasSubstr("--overlay"));
  fs::create_directory_symlink(recording, folder.path() / "link");
  EXPECT_THAT(run(folder.path() / "link/out.json", {}).text, HasSubstr("inside the recording"));
  EXPECT_EQ(std::distance(fs::directory_iterator(recording), {}), 2) << "the set and its list";
  EXPECT_THAT(run(folder.path() / "recording-2.json", {}).text, HasSubstr("drape_A/cam0.png"));
}

TEST(PictureStem, TwoPicturesNeverShareAFile) {
  const std::vector<std::string> names = {"d", "d_a", "d_a_", "_b", "a_b", "b", "a__b", "_"};
  std::set<std::string> stems;
  for (const std::string& set : names)
    for (const std::string& camera : names) stems.insert(picture_stem(set, camera));
  EXPECT_EQ(stems.size(), names.size() * names.size());
  EXPECT_EQ(picture_stem("drape_A", "cam0"), "drape_A_cam0");
}

}  // namespace
}  // namespace drape::test
