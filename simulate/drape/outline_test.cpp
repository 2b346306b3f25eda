// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/outline.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using testing::HasSubstr;
using units::mm;

constexpr double kSpacing_m = 2 * mm;

class Outlines : public testing::Test {
 protected:
  ClothOutline read(const std::string& text, const std::string& name = "piece.svg") {
    write_durable(folder_.path() / name, text);
    return read_outline(folder_.path() / name, kSpacing_m);
  }
  /// Shapes in a drawing of 200 x 200 mm.
  ClothOutline drawn(const std::string& shapes) {
    return read(
        "<?xml version=\"1.0\"?><svg xmlns=\"http://www.w3.org/2000/svg\" width=\"200mm\" "
        "height=\"200mm\" viewBox=\"0 0 200 200\">" +
        shapes + "</svg>");
  }
  std::string refusal(const std::string& shapes) {
    try {
      drawn(shapes);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      return error.what();
    }
    ADD_FAILURE() << "taken: " << shapes;
    return {};
  }

  test::TemporaryFolder folder_;
};

double area_mm2(const Polygon& ring) {
  double sum = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
    sum += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return std::abs(sum) / (mm * mm);
}

TEST_F(Outlines, ADrawingsXIsTheWeftAndItsYTheWarp) {
  const ClothOutline outline = drawn("<rect x='10' y='20' width='100' height='50'/>");
  ASSERT_EQ(outline.outer.size(), 4U);
  EXPECT_NEAR((outline.outer[0] - Eigen::Vector2d(20, 10) * mm).norm(), 0, 1e-12);
  EXPECT_NEAR((outline.outer[1] - Eigen::Vector2d(20, 110) * mm).norm(), 0, 1e-12);
  EXPECT_NEAR((outline.outer[2] - Eigen::Vector2d(70, 110) * mm).norm(), 0, 1e-12);
}

TEST_F(Outlines, UnitsAndViewBoxGiveMillimetres) {
  const char* const shape = "<polygon points='0,0 10,0 10,10 0,10'/></svg>";
  const std::string head = "<svg xmlns='http://www.w3.org/2000/svg' ";
  const auto side = [&](const std::string& size) {
    return read(head + size + ">" + shape).outer[1].y() / mm;
  };
  EXPECT_NEAR(side("width='20cm' height='20cm' viewBox='0 0 100 100'"), 20, 1e-9);
  EXPECT_NEAR(side("width='2in' height='2in' viewBox='-5 -5 50.8 50.8'"), 15, 1e-9);
  EXPECT_NEAR(side("width='96' height='96'"), 25.4 / 9.6, 1e-9);
  for (const char* size : {"", "width='100%' height='100%' viewBox='0 0 9 9'", "width='10mm'",
                           "width='10mm' height='20mm' viewBox='0 0 10 10'",
                           "width='10mm' height='10mm' viewBox='0 0 10'"})
    EXPECT_THROW((void)side(size), Error) << size;
}

TEST_F(Outlines, WhatIsNotSeenAsItIsDrawnIsRefused) {
  const std::string piece = "<rect id='piece' x='50' y='50' width='100' height='100'/>";
  const std::string frame = "<rect width='200' height='200'/>";
  for (const char* hidden :
       {"style='display:none'", "style='opacity:1; DISPLAY : None !important'", "display='none'",
        "style='/* layer 2 */display:none'", "style='/*/ 2 */display:none/* a */'",
        "visibility='hidden'", "style='visibility:collapse'", "opacity='0'",
        "style='transform:scale(2)'", "style='stroke:red;rotate:5deg'", "clip-path='url(#a)'",
        "style='mask:url(#a)'"})
    for (const std::string& layer :
         {"<g id='frame' " + std::string(hidden) + ">" + frame + "</g>",
          "<rect id='frame' " + std::string(hidden) + " width='200' height='200'/>"})
      EXPECT_THAT(refusal(piece + layer),
                  testing::AllOf(HasSubstr("id=frame"), HasSubstr("not seen as it is drawn")));
  for (const char* sheet : {".st0{display:none;}", "rect:hover{display:none}",
                            "<![CDATA[ @media all { g { x: 5px } }]]>",
                            ".a{fill:red} .b { visibility : hidden }", "@import url(other.css);"})
    for (const char* place : {"<style>", "<defs><style type='text/css'>"}) {
      const std::string close = place[1] == 'd' ? "</style></defs>" : "</style>";
      EXPECT_THAT(refusal(fmt::format("{}{}{}{}", place, sheet, close, piece)),
                  HasSubstr("`style`"));
    }
  EXPECT_THROW((void)read("<?xml version='1.0'?><?xml-stylesheet href='a.css'?><svg width='9mm' "
                          "height='9mm'>" +
                          piece + "</svg>"),
               Error);
  EXPECT_THROW((void)read("<svg width='9mm' height='9mm' transform='scale(2)'>" + piece + "</svg>"),
               Error);
  // attributes that editors write for every layer and shape
  const ClothOutline shown = drawn(
      "<style>/* display:none */ .st0{fill:none;stroke-width:2;display:inline}</style>"
      "<g style='display:inline;opacity:0.5' visibility='visible' mask='none'>" +
      piece + "</g>");
  EXPECT_NEAR(area_mm2(shown.outer), 10000, 1e-6);
}

TEST_F(Outlines, ATransformOfMoreThanNumbersIsRefused) {
  for (const char* transform : {"translate(50px,80px)", "translate(5 6 7)", "rotate(90deg)",
                                "scale(2x)", "matrix(1 0 0 1 5 6mm)", "translate(5%)"})
    EXPECT_THAT(refusal("<rect transform='" + std::string(transform) + "' width='9' height='9'/>"),
                HasSubstr("is no transform"));
}

/// Every path command, absolute and relative, draws the same disc or square.
TEST_F(Outlines, PathsDrawWhatTheyShould) {
  const double disc = std::numbers::pi * 30 * 30;
  // A circle as a polygon with edges of 2 mm lacks (2 pi / n)^2 / 6 of its area, n = 94.
  const double lacks = std::pow(2 * std::numbers::pi / 94, 2) / 6;
  const double k = 30 * 4 * (std::numbers::sqrt2 - 1) / 3;  // within 3e-4 of a circle
  const auto text = [](double value) { return std::to_string(value) + " "; };
  for (const std::string& path :
       {std::string("M70 100a30 30 0 0 1 60 0 30 30 0 0 1-60 0z"),
        std::string("M 70,100 A 30,30 0 1,0 130,100 A 30 30 0 10 70 100"),
        "M70 100C70 " + text(100 - k) + text(100 - k) + "70 100 70S130 " + text(100 - k) +
            "130 100 " + text(100 + k) + "130 100 130 70 " + text(100 + k) + "70 100Z"})
    EXPECT_NEAR(area_mm2(drawn("<path d='" + path + "'/>").outer) / disc, 1 - lacks, 5e-4) << path;
  EXPECT_NEAR(area_mm2(drawn("<circle cx='100' cy='100' r='30'/>").outer) / disc, 1 - lacks, 1e-4);
  for (const char* path : {"M10 10H60V60H10Z", "m10 10h50v50h-50z",
                           "M10,10L60,10 60 60 10 60 10 10", "m10 10 50 0 0 50-50 0z"})
    EXPECT_NEAR(area_mm2(drawn(std::string("<path d='") + path + "'/>").outer), 2500, 1e-6) << path;
  // The area under a parabola is two thirds of height times chord; the second one mirrors it.
  const ClothOutline waves = drawn("<path d='M0 50Q25 100 50 50T100 50L100 0 0 0z'/>");
  EXPECT_NEAR(area_mm2(waves.outer), 5000, 1);
}

TEST_F(Outlines, TransformsAndGroupsMoveAndTurn) {
  const ClothOutline outline = drawn(
      "<g transform='translate(100,50) rotate(90)'><g transform='scale(2)'>"
      "<rect x='0' y='0' width='10' height='20'/></g></g>");
  EXPECT_NEAR(area_mm2(outline.outer), 800, 1e-9);
  // (10, 0) is scaled to (20, 0), rotated to (0, 20) and moved to x 100, y 70.
  EXPECT_NEAR((outline.outer[1] - Eigen::Vector2d(70, 100) * mm).norm(), 0, 1e-12);
  EXPECT_THAT(refusal("<g transform='fold(3)'><rect width='9' height='9'/></g>"),
              HasSubstr("is no transform"));
}

TEST_F(Outlines, RingsInsideAreHoles) {
  const ClothOutline outline =
      drawn("<circle cx='50' cy='50' r='10'/><path d='M0 0H100V100H0ZM70 70h9v9h-9z'/>");
  EXPECT_NEAR(area_mm2(outline.outer), 10000, 1e-6);
  ASSERT_EQ(outline.holes.size(), 2U);
  const MaterialMesh mesh = triangulated(outline, {.spacing_m = 4 * mm});
  EXPECT_NEAR(mesh.area_m2() / (mm * mm), 10000 - 81 - area_mm2(outline.holes[0]), 1e-6);
}

TEST_F(Outlines, WhatIsNoOutlineIsRefusedByName) {
  EXPECT_THAT(refusal("<path id='hem' d='M0 0H50V50H0'/>"),
              testing::AllOf(HasSubstr("a line is not closed"), HasSubstr("path id=hem")));
  EXPECT_THAT(refusal("<text>cut here</text>"), HasSubstr("<text> is no closed outline"));
  EXPECT_THAT(refusal("<path d='M0 0H50V50H0X'/>"), HasSubstr("`X` is no command"));
  EXPECT_THAT(refusal("<path d='M0 0H50V50H'/>"), HasSubstr("a number is missing"));
  EXPECT_THAT(refusal("<path d='L50 50 0 50z'/>"), HasSubstr("does not begin with M"));
  EXPECT_THAT(refusal("<path d='M0 0L50 50L50 0L0 50Z'/>"), HasSubstr("cross"));
  EXPECT_THAT(refusal("<rect width='9' height='9'/><rect x='20' width='8' height='8'/>"),
              HasSubstr("is not inside the largest one"));
  EXPECT_THAT(refusal("<polygon points='0,0 10'/>"), HasSubstr("odd number"));
  EXPECT_THAT(refusal("<rect width='a' height='9'/>"), HasSubstr("width is no number"));
  EXPECT_THAT(refusal("<rect width='9' height='9' rx='2'/>"), HasSubstr("rounded"));
  EXPECT_THAT(refusal("<title>nothing</title>"), HasSubstr("no closed outline"));
  EXPECT_THAT(refusal("<circle r='1e300'/>"), HasSubstr("reaches beyond"));
  EXPECT_THAT(refusal("<circle r='1e9'/>"), HasSubstr("reaches beyond"));
  EXPECT_THAT(refusal("<g transform='" + std::string(2000, ' ') + "'/>"), HasSubstr("too long"));
  std::string comb = "M0 0";
  for (int i = 0; i < 25000; ++i) comb += "h.01v.01";
  EXPECT_THAT(refusal("<path d='" + comb + "z'/>"), HasSubstr("more than 20000 corners"));
  std::string deep;
  for (int i = 0; i < 200; ++i) deep += "<g>";
  for (int i = 0; i < 200; ++i) deep += "</g>";
  EXPECT_THAT(refusal(deep), HasSubstr("too deep"));
  EXPECT_THROW((void)read("no xml"), Error);
  EXPECT_THROW((void)read("0,0", "piece.dxf"), Error);
}

TEST_F(Outlines, CsvHasARingPerNumber) {
  const ClothOutline outline = read(
      "ring,warp_mm,weft_mm\n0,0,0\n0,100,0\n0,100,80\n0,0,80\n0,0,0\n1,20,20\n1,40,20\n1,40,40\n",
      "piece.csv");
  EXPECT_NEAR(area_mm2(outline.outer), 8000, 1e-9);
  ASSERT_EQ(outline.holes.size(), 1U);
  EXPECT_NEAR(area_mm2(outline.holes[0]), 200, 1e-9);
  EXPECT_THROW((void)read("ring,warp_mm,weft_mm\n0,0,nothing\n", "wrong.csv"), Error);
}

/// A corner given twice, anywhere in its ring, counts once, and the mesh is not cut there.
TEST_F(Outlines, ACornerThatStandsTwiceIsOne) {
  const std::vector<std::string> corners = {"0,20,20\n", "0,180,20\n", "0,180,150\n", "0,100,190\n",
                                            "0,20,150\n"};
  const auto with_twice = [&](std::size_t twice) {
    std::string text = "ring,warp_mm,weft_mm\n";
    for (std::size_t k = 0; k < corners.size(); ++k)
      text += corners[k] + (k == twice ? corners[k] : "");
    return read(text, "piece.csv");
  };
  const ClothOutline plain = with_twice(corners.size());
  for (std::size_t twice = 0; twice < corners.size(); ++twice) {
    EXPECT_EQ(with_twice(twice).outer, plain.outer) << twice;
    // Passed on unchanged, it does not tear the mesh.
    ClothOutline doubled = plain;
    doubled.outer.insert(doubled.outer.begin() + static_cast<std::ptrdiff_t>(twice),
                         doubled.outer[twice]);
    for (const double spacing_mm : {10, 15})
      EXPECT_NEAR(triangulated(doubled, {.spacing_m = spacing_mm * mm}).border_m(),
                  triangulated(plain, {.spacing_m = spacing_mm * mm}).border_m(), 1e-9)
          << twice << ' ' << spacing_mm;
  }
  const MaterialMesh mesh = triangulated(plain, {.spacing_m = 15 * mm});
  EXPECT_NEAR(mesh.border_m() / mm, 160 + 130 + 2 * std::hypot(80, 40) + 130, 1e-6);
}

TEST_F(Outlines, RingsThatTouchAreRefusedByName) {
  const std::string square = "0,0,0\n0,90,0\n0,90,90\n0,0,90\n";
  const std::string hole = "1,30,30\n1,60,30\n1,60,60\n1,30,60\n";
  const auto ring = [](std::string text, char number) {
    for (std::size_t at = 0; at < text.size(); at = text.find('\n', at) + 1) text[at] = number;
    return text;
  };
  const auto refused = [&](const std::string& corners, const std::string& why) {
    try {
      (void)read("ring,warp_mm,weft_mm\n" + corners, "wrong.csv");
      ADD_FAILURE() << "taken: " << corners;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::AllOf(HasSubstr(why), HasSubstr("wrong.csv")));
    }
  };
  EXPECT_EQ(read("ring,warp_mm,weft_mm\n" + square + hole, "piece.csv").holes.size(), 1U);
  refused(square + ring(square, '1'), "stands there twice");
  refused(square + hole + ring(hole, '2'), "stands there twice");
  refused(square + hole + "2,40,40\n2,50,40\n2,50,50\n", "is inside a hole");
  refused("0,0,0\n0,90,0\n0,90,90\n0,45,90\n0,45,120\n0,45,90\n0,0,90\n", "runs back on itself");
  refused("0,0,0\n0,90,0\n0,90,90\n0,40,90\n0,60,90\n0,0,90\n", "runs back on itself");
  refused(square + "1,0,30\n1,30,30\n1,30,60\n", "touch near warp 0.0, weft 30.0 mm");
  refused("0,20,20\n0,180,180\n0,180,20\n0,20,180\n", "cross near warp 100.0, weft 100.0 mm");
  refused("0,0,0\n0,90,0\n0,45,45\n0,90,90\n0,0,90\n0,45,45\n", "touch near");
  refused(square + "1,30,30\n1,60,30\n1,60,30\n", "fewer than three corners");
  refused(square + hole + square, "goes on after another one");
  EXPECT_THAT(refusal("<rect width='90' height='90'/><path d='M30 30H60Z'/>"),
              HasSubstr("fewer than three corners"));
}

}  // namespace
}  // namespace drape::simulate
