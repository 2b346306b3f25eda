// SPDX-License-Identifier: Apache-2.0
// Plain dot grids without tags: the dots of six photographs of an 8 x 10 grid (BoofCV-Data, CC BY
// 4.0), drawn as measured, and the photographs themselves if available.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <set>

#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "detect/detect.hpp"
#include "detect/test_pictures.hpp"
#include "tests/support/drawing.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::test {

using namespace detect;

namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int photos = 6;

/// A rig and a recording of the photographs, as a user of such a target would make them.
class GridBench {
 public:
  explicit GridBench(const std::vector<fs::path>& pictures) {
    write_durable(folder_.path() / "target.toml",
                  "schema = \"drapebench/target/1\"\nkind = \"dot-grid\"\nrows = 8\ncols = 10\n"
                  "pitch_mm = 25.0\ndot_diameter_mm = 15.0\n");
    rig.name = "grid";
    rig.target_file = folder_.path() / "target.toml";
    rig.cameras = {{"cam0", 640, 480, 1e-6, 1e-6}};
    recording.folder = folder_.path();
    for (int k = 0; k < photos; ++k) {
      const std::string name = "pose_" + std::to_string(k);
      const fs::path& from = pictures[static_cast<std::size_t>(k)];
      const std::string file = name + "/cam0" + from.extension().string();
      fs::create_directories(folder_.path() / name);
      fs::copy_file(from, folder_.path() / file);
      recording.sets.push_back({name, {{"cam0", file, sha256_of_file(from), 640, 480, {}}}});
      options.sets.push_back(name);
    }
    options.surface = Surface::target;
  }

  Rig rig;
  Recording recording;
  DetectOptions options;

 private:
  TemporaryFolder folder_;
};

/// Largest distance from the projective map through all dots, in pitches; a wrong index gives one.
double worst_in_pitches(const std::vector<Detection>& dots) {
  std::vector<Eigen::Vector2d> places, seen;
  for (const Detection& dot : dots) {
    places.emplace_back(dot.mark.col, dot.mark.row);
    seen.push_back(dot.centre_px);
  }
  const Eigen::Matrix3d map = homography(places, seen).value();
  double worst = 0;
  for (std::size_t i = 0; i < dots.size(); ++i) {
    const double pitch = derivative_at(map, places[i]).colwise().norm().minCoeff();
    worst = std::max(worst, (mapped(map, places[i]) - seen[i]).norm() / pitch);
  }
  return worst;
}

/// Paints out a dot: its ellipse and the blur around it get the grey level next to it.
void paint_out(const Detection& dot, GreyImage& image) {
  cv::Mat picture = view_of(image);
  const auto ellipse = [&](double more_px) {
    const Eigen::Vector2d size = 2 * (dot.semi_axes_px.array() + more_px);
    return cv::RotatedRect(
        cv::Point2f(static_cast<float>(dot.centre_px.x()), static_cast<float>(dot.centre_px.y())),
        cv::Size2f(static_cast<float>(size.x()), static_cast<float>(size.y())),
        static_cast<float>(dot.axis_angle_rad * 180 / std::acos(-1.0)));
  };
  cv::Mat ring(picture.size(), CV_8U, cv::Scalar(0));
  cv::ellipse(ring, ellipse(3.0), 255, cv::FILLED);
  cv::ellipse(ring, ellipse(2.0), 0, cv::FILLED);
  cv::ellipse(picture, ellipse(2.0), cv::mean(picture, ring), cv::FILLED);
}

GreyImage without(const std::set<MarkId>& gone, const FrameDetections& dots, GreyImage picture) {
  for (const Detection& dot : dots.detections)
    if (gone.count(dot.mark) != 0) paint_out(dot, picture);
  return picture;
}

std::set<MarkId> random_marks(unsigned seed, std::size_t count) {
  std::mt19937 random(seed);
  std::set<MarkId> marks;
  while (marks.size() < count) {
    marks.insert({static_cast<int>(random() % 8), static_cast<int>(random() % 10)});
  }
  return marks;
}

/// The dots of photograph `k` as measured in it (tests/data/dot-grid-photos), drawn dark on grey,
/// for use without the photographs.
cv::Mat drawn(int k) {
  Drawing drawing(640, 480, 190);
  const Csv dots =
      read_csv(test_data("dot-grid-photos") / "ellipses.csv",
               {"photograph", "u_px", "v_px", "semi_major_px", "semi_minor_px", "angle_deg"});
  for (std::size_t i = 0; i < dots.lines.size(); ++i) {
    const auto& of = dots.columns;
    if (of[0][i] != k) continue;
    drawing.ellipse({of[1][i], of[2][i]}, {of[3][i], of[4][i]}, of[5][i], 40);
  }
  return drawing.picture(0.7);
}

/// Pictures of a pose: the drawn dots, and the photograph if available.
std::vector<GreyImage> pictures_of(int k) {
  std::vector<GreyImage> pictures{image_of(drawn(k))};
  if (const auto folder = reference_data("dot-grid-photos"))
    pictures.push_back(image_of(cv::imread(
        (*folder / ("image0000" + std::to_string(k) + ".jpg")).string(), cv::IMREAD_GRAYSCALE)));
  return pictures;
}

/// Checks that all dots are found and labelled consistently with a plane.
void expect_all_eighty(const std::vector<fs::path>& pictures) {
  const GridBench bench(pictures);
  const DetectResult result = detect::detect(bench.recording, bench.rig, bench.options);
  ASSERT_EQ(result.detections.frames.size(), static_cast<std::size_t>(photos));
  for (const FrameDetections& frame : result.detections.frames) {
    EXPECT_EQ(frame.detections.size(), 80U) << frame.set;
    EXPECT_TRUE(frame.islands.empty()) << frame.set;
    ASSERT_GE(frame.detections.size(), 8U);
    std::cout << frame.set << ": " << frame.detections.size() << " dots, largest distance from a "
              << "plane's view " << worst_in_pitches(frame.detections) << " pitches, sigma "
              << std::sqrt(frame.detections[40].covariance_px2.trace() / 2) << " px\n";
    // The lens bends lines by a few per cent of a pitch; a wrong index would add a whole pitch.
    EXPECT_LT(worst_in_pitches(frame.detections), 0.35) << frame.set;
  }
  ASSERT_FALSE(result.report.warnings.empty());
  EXPECT_THAT(result.report.warnings.back(), HasSubstr("upside down"));
}

TEST(DotGrid, AllEightyDotsOfSixPhotographsWithoutATag) {
  const TemporaryFolder folder;
  std::vector<fs::path> drawings, photographs;
  const auto at_hand = reference_data("dot-grid-photos");
  for (int k = 0; k < photos; ++k) {
    drawings.push_back(folder.path() / ("drawn" + std::to_string(k) + ".png"));
    cv::imwrite(drawings.back().string(), drawn(k));
    if (at_hand) photographs.push_back(*at_hand / ("image0000" + std::to_string(k) + ".jpg"));
  }
  expect_all_eighty(drawings);
  if (at_hand) expect_all_eighty(photographs);
}

PrintPlane grid_plane() {
  Target target;
  target.rows = 8;
  target.cols = 10;
  target.pitch_m = 0.025;
  target.dot_diameter_m = 0.015;
  return plane_of(target);
}

FrameDetections look(const GreyImage& image) {
  TagFinder no_tags("");
  return detect_frame(image, grid_plane(), no_tags, {});
}

void expect_the_rest(const FrameDetections& whole, const FrameDetections& rest,
                     const std::set<MarkId>& gone) {
  EXPECT_EQ(rest.detections.size(), 80 - gone.size());
  for (const Detection& dot : rest.detections) {
    const auto before = std::find_if(whole.detections.begin(), whole.detections.end(),
                                     [&](const Detection& d) { return d.mark == dot.mark; });
    ASSERT_NE(before, whole.detections.end());
    EXPECT_EQ(gone.count(dot.mark), 0U);
    // Paint over a neighbour can touch the ring used for fitting a dot.
    EXPECT_LT((before->centre_px - dot.centre_px).norm(), 1.0);
  }
}

TEST(DotGrid, AnyTenDotsMayBePaintedOut) {
  const int choices = trial_count(3, 40);
  for (int k = 0; k < photos; ++k) {
    for (const GreyImage& whole : pictures_of(k)) {
      const FrameDetections before = look(whole);
      ASSERT_EQ(before.detections.size(), 80U) << k;
      for (int choice = 0; choice < choices; ++choice) {
        SCOPED_TRACE("photograph " + std::to_string(k) + ", choice " + std::to_string(choice));
        const std::set<MarkId> gone = random_marks(100 * k + choice, 10);
        expect_the_rest(before, look(without(gone, before, whole)), gone);
      }
    }
  }
}

TEST(DotGrid, AnIsolatedCornerIsReachedOverTheHole) {
  // All dots within two steps of the corner (0, 0), and two others.
  const std::set<MarkId> gone = {{0, 1}, {0, 2}, {1, 0}, {1, 1}, {1, 2},
                                 {2, 0}, {2, 1}, {2, 2}, {5, 5}, {7, 9}};
  for (const GreyImage& whole : pictures_of(0)) {
    const FrameDetections before = look(whole);
    expect_the_rest(before, look(without(gone, before, whole)), gone);
  }
}

/// Checks that detections.json keeps the separate pieces.
void expect_kept(const FrameDetections& rest) {
  const TemporaryFolder out;
  Detections written;
  written.lattice = {Surface::target, 8, 10, 0.025, 0.015, {0, 0}, {0, 0}, "x"};
  written.frames = {rest};
  written.frames[0].set = "stage_z000";
  written.frames[0].camera = "cam0";
  write_detections(out.path() / "detections.json", written);
  const Detections back = read_detections(out.path() / "detections.json");
  ASSERT_EQ(back.frames[0].islands.size(), rest.islands.size());
  for (std::size_t k = 0; k < rest.islands.size(); ++k) {
    EXPECT_EQ(back.frames[0].islands[k].island, rest.islands[k].island);
    EXPECT_EQ(back.frames[0].islands[k].dot.mark, rest.islands[k].dot.mark);
    EXPECT_EQ(back.frames[0].islands[k].dot.centre_px, rest.islands[k].dot.centre_px);
  }
}

TEST(DotGrid, WithoutAWholeOuterColumnThePlaceIsNotGuessed) {
  std::set<MarkId> gone;
  for (int row = 0; row < 8; ++row) gone.insert({row, 0});
  for (const GreyImage& whole : pictures_of(0)) {
    const FrameDetections before = look(whole);
    const FrameDetections rest = look(without(gone, before, whole));
    EXPECT_TRUE(rest.detections.empty());
    EXPECT_EQ(rest.islands.size(), 72U);
    for (const IslandDot& dot : rest.islands) {
      const auto same = std::find_if(
          before.detections.begin(), before.detections.end(),
          [&](const Detection& d) { return (d.centre_px - dot.dot.centre_px).norm() < 1.0; });
      ASSERT_NE(same, before.detections.end());
    }
    expect_kept(rest);
  }
}

}  // namespace
}  // namespace drape::test
