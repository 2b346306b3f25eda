// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "detect/prints/layout.hpp"
#include "detect/test_pictures.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::detect {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using units::mm;

constexpr double kPxPerMm = 10;

Print print_named(const std::string& name) {
  return read_print(test::source_root() / "rigs" / name);
}

Target bench1_target() {
  return read_target(test::source_root() / "rigs/bench1/target.toml");
}

bool has_rasteriser() {
  return std::system("pdftoppm -v >/dev/null 2>&1") == 0;
}

/// The PDF as drawn by poppler at 10 px/mm, as a camera might see it: no pure black or white,
/// blurred by a lens, with noise.
GreyImage seen(const Page& page) {
  const test::TemporaryFolder folder;
  write_durable(folder.path() / "page.pdf", pdf_of(page));
  const std::string line =
      fmt::format("pdftoppm -r {} -gray -png -singlefile '{}' '{}'", kPxPerMm * 25.4,
                  (folder.path() / "page.pdf").string(), (folder.path() / "page").string());
  EXPECT_EQ(std::system(line.c_str()), 0);
  cv::Mat drawn = cv::imread((folder.path() / "page.png").string(), cv::IMREAD_GRAYSCALE);
  EXPECT_FALSE(drawn.empty());
  cv::Mat light;
  drawn.convertTo(light, CV_64F, 0.6, 40);
  return test::exposed(light, 0.8, 1.5, 4);
}

/// Checks that every dot and tag is found where the description places it on the paper.
template <class Sheet>
void expect_exact(const PrintedPage& printed, const Sheet& sheet, const std::string& name) {
  const PrintPlane plane = plane_of(sheet);
  TagFinder finder(plane.tag_family);
  const FrameDetections found = detect_frame(seen(printed.page), plane, finder, {});
  EXPECT_EQ(found.detections.size(), static_cast<std::size_t>(plane.rows) * plane.cols) << name;
  EXPECT_EQ(found.tags.size(), plane.tags.size()) << name;
  const auto upright =
      std::count_if(found.tags.begin(), found.tags.end(), [](const TagDetection& tag) {
        return (tag.corners_px.col(2) - tag.corners_px.col(0)).minCoeff() > 0;
      });
  EXPECT_EQ(upright, static_cast<std::ptrdiff_t>(plane.tags.size())) << name;
  double worst = 0, sum = 0;
  for (const Detection& d : found.detections) {
    const Eigen::Vector2d on_paper = printed.face_m + face_point(sheet, d.mark);
    // The centre of the first pixel is half a pixel from the paper's edge.
    const Eigen::Vector2d measured = (d.centre_px.array() + 0.5).matrix() / kPxPerMm * mm;
    worst = std::max(worst, (measured - on_paper).norm() / mm);
    sum += (measured - on_paper).squaredNorm() / (mm * mm);
  }
  std::printf("%s on %s: %zu dots, %zu tags, RMS %.4f mm, worst %.4f mm\n", name.c_str(),
              printed.paper.c_str(), found.detections.size(), found.tags.size(),
              std::sqrt(sum / static_cast<double>(found.detections.size())), worst);
  EXPECT_LE(worst, 0.02) << name;
}

TEST(PrintedPage, IsFoundByTheDetectorWhereItShouldBe) {
  if (!has_rasteriser()) GTEST_SKIP() << "pdftoppm is not installed (poppler-utils)";
  for (const std::string name : {"bench1/print.toml", "prints/patch-11.toml",
                                 "prints/patch-21.toml", "prints/patch-11-classes.toml"}) {
    const Print print = print_named(name);
    expect_exact(page_of(print, Paper::automatic), print, name);
  }
  const Target target = bench1_target();
  expect_exact(page_of(target, "target", Paper::automatic), target, "bench1/target.toml");
}

TEST(PrintedPage, HasItsNumbersInThePdfAndTheSvg) {
  const Print print = print_named("prints/patch-11.toml");
  const PrintedPage printed = page_of(print, Paper::automatic);
  EXPECT_EQ(printed.paper, "a4");
  EXPECT_TRUE(printed.check_m.isApprox(Eigen::Vector2d(190, 190) * mm, 1e-12));
  const std::string pdf = pdf_of(printed.page), svg = svg_of(printed.page);
  EXPECT_THAT(pdf, AllOf(HasSubstr("/MediaBox [0 0 595.275591 841.889764]"),
                         HasSubstr("/PrintScaling /None"), HasSubstr("2.8346456693 0 0")));
  EXPECT_THAT(svg, AllOf(HasSubstr("width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\""),
                         HasSubstr("<circle cx=\"10\" cy=\"10\" r=\"1.5\"/>"),
                         HasSubstr("<circle cx=\"200\" cy=\"200\" r=\"1.5\"/>")));
  EXPECT_EQ(pdf, pdf_of(page_of(print, Paper::automatic).page));
  // The file's cross-reference table must be right to the byte.
  const std::size_t table = pdf.find("xref\n");
  EXPECT_THAT(pdf, HasSubstr(fmt::format("startxref\n{}\n", table)));
  for (int object = 1; object <= 6; ++object) {
    const std::string place = pdf.substr(table + 4 + 1 + 4 + 20 * object, 10);
    EXPECT_EQ(pdf.compare(std::stoul(place), 6, fmt::format("{} 0 ob", object)), 0) << object;
  }
}

/// A window of 3 x 3 characters rotated by a quarter turn.
std::string turned(const std::string& w) {
  return {w[6], w[3], w[0], w[7], w[4], w[1], w[8], w[5], w[2]};
}

TEST(PrintedPage, EveryWindowOfTheClassesOccursOnce) {
  const DotClasses fine = *print_named("prints/patch-21-classes.toml").dot_classes;
  check_windows(fine);
  const DotClasses classes = *print_named("prints/patch-11-classes.toml").dot_classes;
  check_windows(classes);
  std::set<std::string> seen;
  for (std::size_t row = 0; row + 2 < classes.rows.size(); ++row) {
    for (std::size_t col = 0; col + 2 < classes.rows[row].size(); ++col) {
      std::string window;
      for (std::size_t i = 0; i < 3; ++i) window += classes.rows[row + i].substr(col, 3);
      for (int quarter = 0; quarter < 4; ++quarter, window = turned(window))
        EXPECT_TRUE(seen.insert(window).second) << row << " " << col << " turned " << quarter;
    }
  }
  EXPECT_EQ(seen.size(), 4U * 81);
  const std::string svg =
      svg_of(page_of(print_named("prints/patch-11-classes.toml"), Paper::automatic).page);
  // In row 0, col 0 is full and col 1 has a light centre of 1.2 mm.
  EXPECT_THAT(svg, testing::Not(HasSubstr("<circle cx=\"10\" cy=\"10\" r=\"0.6\"")));
  EXPECT_THAT(svg, HasSubstr("<circle cx=\"29\" cy=\"10\" r=\"0.6\" fill=\"#fff\"/>"));
}

TEST(PrintedPage, AChessboardHasADarkSquareAboveItsFirstCorner) {
  Target board;
  board.kind = TargetKind::chessboard;
  board.rows = 6;
  board.cols = 9;
  board.pitch_m = 20 * mm;
  const PrintedPage printed = page_of(board, "board", Paper::automatic);
  EXPECT_EQ(printed.paper, "a4 landscape");
  EXPECT_TRUE(printed.check_m.isApprox(Eigen::Vector2d(160, 100) * mm, 1e-12));
  const auto has_board = [&](const auto& item) {
    const auto* area = std::get_if<PageArea>(&item);
    return area != nullptr && area->boxes.size() == 35;
  };
  const auto& items = printed.page.items;
  const auto found = std::find_if(items.begin(), items.end(), has_board);
  ASSERT_NE(found, items.end()) << "7 x 10 squares, half of them dark";
  const auto& boxes = std::get<PageArea>(*found).boxes;
  const Eigen::Vector2d above = printed.face_m + face_point(board, MarkId{1, 0});
  EXPECT_TRUE(std::any_of(boxes.begin(), boxes.end(), [&](const PageBox& box) {
    return (box.corner_m - above).norm() < 1e-12;
  }));
}

template <class F>
std::string refusal(F&& call) {
  try {
    static_cast<void>(call());
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(PrintedPage, RefusesByName) {
  const Print good = print_named("prints/patch-11.toml");
  const Paper a4 = Paper::a4;
  EXPECT_EQ(refusal([&] { return page_of(good, a4); }), "");
  Print large = good;
  large.patch_m.x() = 280 * mm;
  EXPECT_THAT(refusal([&] { return page_of(large, a4); }),
              AllOf(HasSubstr("210.0 x 306.0 mm"), HasSubstr("a4"), HasSubstr("--paper fit")));
  EXPECT_EQ(page_of(large, Paper::automatic).paper, "a3");
  EXPECT_NEAR(page_of(large, Paper::fit).page.size_m.y(), 306 * mm, 1e-12);
  Print twice = print_named("prints/patch-11-classes.toml");
  twice.dot_classes->rows[8] = twice.dot_classes->rows[5];
  twice.dot_classes->rows[9] = twice.dot_classes->rows[6];
  twice.dot_classes->rows[10] = twice.dot_classes->rows[7];
  EXPECT_THAT(refusal([&] { return page_of(twice, Paper::automatic); }),
              AllOf(HasSubstr("(8, 0) look like those from (5, 0)"), HasSubstr("dot_classes")));
  Print crowded = good;
  crowded.tag_edge_m = 17 * mm;
  EXPECT_THAT(refusal([&] { return page_of(crowded, Paper::automatic); }),
              AllOf(HasSubstr("tags.edge_mm"), HasSubstr("nearest dot")));
  // The margin is smaller than a dot's radius, at the first and at the last dots.
  EXPECT_THAT(refusal([&] { return page_of(print_named("paper/print.toml"), Paper::automatic); }),
              AllOf(HasSubstr("margin_mm"), HasSubstr("across the edge")));
  Print cut = good;
  cut.margin_m.y() += 4 * mm;
  EXPECT_THAT(refusal([&] { return page_of(cut, Paper::automatic); }), HasSubstr("1 mm from it"));
  Print unknown = good;
  unknown.tag_family = "tag99h1";
  EXPECT_THAT(refusal([&] { return page_of(unknown, Paper::automatic); }), HasSubstr("tag36h11"));
  Print no_tag = good;
  no_tag.tags[0].id = 100000;
  EXPECT_THAT(refusal([&] { return page_of(no_tag, Paper::automatic); }),
              HasSubstr("no tag 100000"));
}

/// The plate's description is beside its page and never replaces another file.
TEST(ObjectTags, ReplaceOnlyWhatTheyWroteAndNothingWhenRefused) {
  const test::TemporaryFolder folder;
  const fs::path pdf = folder.path() / "plate.pdf", toml = folder.path() / "plate.toml";
  const auto ends = [&](const std::string& options) {
    return test::run_line(fmt::format("{} object-tags --out {} {}",
                                      test::program("drape-detect print").string(), pdf.string(),
                                      options))
        .exit_code;
  };
  write_durable(toml, "name = \"a rig\"\n");
  EXPECT_EQ(ends(""), 3);
  EXPECT_EQ(read_text(toml), "name = \"a rig\"\n");
  EXPECT_FALSE(fs::exists(pdf));
  fs::remove(toml);
  EXPECT_EQ(ends(""), 0);
  EXPECT_EQ(read_target(toml).rows, 5);
  const std::string first = read_text(toml), record = read_text(folder.path() / "plate.run.json");
  EXPECT_EQ(ends("--first-id 585"), 3);  // the family ends at 586
  EXPECT_EQ(read_text(toml), first);
  EXPECT_EQ(read_text(folder.path() / "plate.run.json"), record);
  EXPECT_EQ(ends("--size-mm 60"), 0);  // its own plate is written again
  EXPECT_EQ(read_target(toml).rows, 4);
  write_durable(toml, read_text(toml) + "# measured: 59.2 mm\n");
  EXPECT_EQ(ends(""), 3);
}

}  // namespace
}  // namespace drape::detect
