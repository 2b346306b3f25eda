// SPDX-License-Identifier: Apache-2.0
// Views that lose marks are reported with the reason: light, sharpness, or another print.
#include "detect/detect.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <utility>

#include "core/units.hpp"
#include "detect/test_pictures.hpp"

namespace drape::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using units::mm;

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

}  // namespace
}  // namespace drape::test
