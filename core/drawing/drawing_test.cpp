// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "core/drawing/svg.hpp"

namespace drape {
namespace {

TEST(Svg, EscapesText) {
  EXPECT_EQ(xml("a<b & \"c\">\x01"), "a&lt;b &amp; &quot;c&quot;&gt; ");
}

TEST(Svg, CoordinatesAreShort) {
  EXPECT_EQ(coordinate(1.0), "1");
  EXPECT_EQ(coordinate(-0.001), "0");
  EXPECT_EQ(coordinate(12.346), "12.35");
}

TEST(Svg, Base64OfKnownBytesIsThatOfTheStandard) {  // RFC 4648, section 10
  EXPECT_EQ(base64({'f', 'o', 'o', 'b'}), "Zm9vYg==");
  EXPECT_EQ(base64({'f', 'o', 'o', 'b', 'a'}), "Zm9vYmE=");
  EXPECT_EQ(base64({'f', 'o', 'o', 'b', 'a', 'r'}), "Zm9vYmFy");
  EXPECT_EQ(base64({0xff, 0xfe, 0xfd}), "//79");
}

TEST(Chart, AxesEndAtWholeStepsOrAtTheValues) {
  const Axis whole = axis_over("", 0.3, 7.3, 5, true), exact = axis_over("", 0.3, 7.3, 5, false);
  EXPECT_EQ(whole.low, 0);
  EXPECT_EQ(whole.high, 8);
  EXPECT_EQ(whole.step, 2);
  EXPECT_EQ(exact.low, 0.3);
  EXPECT_EQ(exact.high, 7.3);
  EXPECT_GT(axis_over("", 2, 2, 5, true).high, 2) << "one value still has an axis";
}

TEST(Chart, PlacesValuesBetweenTheEndsOfItsAxes) {
  Svg svg(100, 100, "chart");
  const Chart chart(svg, {10, 20, 60, 40}, {"length (mm)", 0, 6, 2}, {"force (N)", -1, 1, 1});
  EXPECT_EQ(chart.at(0, -1), Eigen::Vector2d(10, 60));
  EXPECT_EQ(chart.at(6, 1), Eigen::Vector2d(70, 20));
  EXPECT_EQ(chart.at(3, 0), Eigen::Vector2d(40, 40));
  for (const char* text : {">length (mm)<", ">force (N)<", ">4<", ">-1<"})
    EXPECT_THAT(svg.finish(), testing::HasSubstr(text));
}

}  // namespace
}  // namespace drape
