// SPDX-License-Identifier: Apache-2.0
#include "triangulate/islands.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cstdio>
#include <map>
#include <random>

#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/trials.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {
namespace {

using test::bench1_truth;
using testing::HasSubstr;
using units::mm;

Calibration true_cameras() {
  Calibration calibration;
  calibration.method = "tsai";
  calibration.rig = "bench1";
  for (const Camera& camera : bench1_truth().cameras) {
    CalibratedCamera calibrated;
    calibrated.camera = camera;
    calibration.cameras.push_back(calibrated);
  }
  return calibration;
}

/// Detections of a drape by bench1's renderer, with noise: every dot that is whole in a camera.
Detections seen_dots(const std::string& drape, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.03);
  Detections detections;
  detections.rig = "bench1";
  detections.lattice = {Surface::cloth,     11, 11, 20 * mm, 4 * mm, {220 * mm, 220 * mm},
                        {10 * mm, 10 * mm}, {}};
  for (std::size_t camera = 0; camera < 3; ++camera) {
    FrameDetections frame;
    frame.set = "s";
    frame.camera = bench1_truth().cameras[camera].name;
    frame.width_px = 1600;
    frame.height_px = 1200;
    for (const test::TrueDot& dot : bench1_truth().drapes.at(drape)) {
      const test::TrueView& view = dot.views[camera];
      if (!view.visible || view.cos_view < 0.3) continue;
      Detection d;
      d.mark = dot.mark;
      d.centre_px = view.centroid_px + Eigen::Vector2d(noise(random), noise(random));
      d.covariance_px2 = 9e-4 * Eigen::Matrix2d::Identity();
      d.semi_axes_px = {8, 8 * view.cos_view};
      frame.detections.push_back(d);
    }
    detections.frames.push_back(frame);
  }
  return detections;
}

using Labels = std::map<std::pair<double, double>, MarkId>;  ///< by position in the picture

std::pair<double, double> key(const Detection& d) {
  return {d.centre_px.x(), d.centre_px.y()};
}

/// Removes the labels of a block of marks in one frame, rotated by quarter turns: an island.
Labels make_island(FrameDetections& frame, int number, MarkId least, MarkId most, int turns) {
  Labels truth;
  std::vector<Detection> kept;
  for (const Detection& d : frame.detections) {
    const bool inside = d.mark.row >= least.row && d.mark.row <= most.row &&
                        d.mark.col >= least.col && d.mark.col <= most.col;
    if (!inside) {
      kept.push_back(d);
      continue;
    }
    truth[key(d)] = d.mark;
    MarkId place = d.mark;
    for (int k = 0; k < turns; ++k) place = {place.col, -place.row};
    frame.islands.push_back({number, d});
    frame.islands.back().dot.mark = {place.row + 20, place.col + 20};
  }
  frame.detections = kept;
  return truth;
}

int wrong_labels(const FrameDetections& frame, const Labels& truth) {
  int wrong = 0;
  for (const Detection& d : frame.detections) {
    const auto known = truth.find(key(d));
    if (known != truth.end()) wrong += d.mark != known->second;
  }
  return wrong;
}

/// As triangulate() sets them.
IslandOptions limits() {
  IslandOptions options;
  options.most_stretch = TriangulateOptions{}.max_stretch;
  options.min_angle_rad = TriangulateOptions{}.min_angle_deg * units::deg;
  return options;
}

TEST(Islands, FindTheirPlaceInAnyTurnAndNeverAWrongOne) {
  const Calibration calibration = true_cameras();
  const int trials = test::trial_count(30, 1000);
  int islands = 0, merged = 0, dots = 0, wrong = 0;
  for (int trial = 0; trial < trials; ++trial) {
    std::mt19937 random(static_cast<unsigned>(trial));
    const auto pick = [&](int count) { return static_cast<int>(random() % count); };
    Detections detections = seen_dots(std::array{"A", "C", "E"}[trial % 3], 1000U + trial);
    const std::size_t f = static_cast<std::size_t>(pick(3));
    const MarkId least{pick(8), pick(8)};
    const MarkId most{least.row + 1 + pick(4), least.col + 1 + pick(4)};
    const Labels truth = make_island(detections.frames[f], 0, least, most, pick(4));
    if (truth.size() < 4) continue;
    const MergedIslands result = merge_islands(detections, calibration, "s", limits());
    ++islands;
    merged += result.fates.front().merged;
    if (result.fates.front().merged) dots += static_cast<int>(truth.size());
    wrong += wrong_labels(result.detections.frames[f], truth);
  }
  std::printf("%d islands, %d merged (%d dots), %d wrong labels\n", islands, merged, dots, wrong);
  EXPECT_EQ(wrong, 0);
  EXPECT_GE(merged, islands / 2);
}

TEST(Islands, OneThatNoOtherViewKnowsIsLeftAlone) {
  Detections detections = seen_dots("A", 5);
  const Labels truth = make_island(detections.frames[0], 0, {3, 3}, {6, 6}, 1);
  ASSERT_GE(truth.size(), 4U);
  detections.frames[1].detections.clear();
  detections.frames[2].detections.clear();
  const MergedIslands result = merge_islands(detections, true_cameras(), "s", limits());
  ASSERT_EQ(result.fates.size(), 1U);
  EXPECT_FALSE(result.fates[0].merged);
  EXPECT_THAT(result.fates[0].reason, HasSubstr("no view speaks for any place"));
  EXPECT_EQ(result.detections.frames[0].islands.size(), truth.size());
}

TEST(Islands, OneThatIsGrownWronglyIsLeftAlone) {
  // A fold hides a row, and the piece is numbered as if it did not exist.
  Detections detections = seen_dots("A", 6);
  make_island(detections.frames[0], 0, {3, 3}, {6, 6}, 0);
  std::vector<IslandDot>& dots = detections.frames[0].islands;
  std::erase_if(dots, [](const IslandDot& d) { return d.dot.mark.row == 25; });
  for (IslandDot& d : dots) d.dot.mark.row -= d.dot.mark.row > 25;
  const std::size_t before = detections.frames[0].detections.size();
  const MergedIslands result = merge_islands(detections, true_cameras(), "s", limits());
  EXPECT_FALSE(result.fates.at(0).merged);
  EXPECT_EQ(result.detections.frames[0].detections.size(), before);
}

TEST(Islands, TheSheetHoldsMergedMarksAndTheReportSaysSo) {
  Detections detections = seen_dots("A", 7);
  for (FrameDetections& frame : detections.frames) frame.detections.shrink_to_fit();
  const Labels truth = make_island(detections.frames[1], 4, {4, 4}, {6, 6}, 3);
  const Calibration calibration = true_cameras();
  TriangulateOptions options;
  const TriangulateResult with = triangulate(detections, calibration, "s", options);
  options.merge_islands = false;
  const TriangulateResult without = triangulate(detections, calibration, "s", options);
  EXPECT_EQ(with.report.merged_islands, 1);
  EXPECT_EQ(with.report.merged_dots, static_cast<int>(truth.size()));
  EXPECT_THAT(with.report.island_fates.at(0), HasSubstr("island 4"));
  EXPECT_EQ(without.report.islands, 0);
  EXPECT_GE(with.report.measured, without.report.measured);
  for (const SheetMark& mark : with.sheet.marks) {
    const auto& dot = bench1_truth().drapes.at("A")[mark.mark.row * 11 + mark.mark.col];
    EXPECT_LT((mark.point_in_world - dot.point_in_world).norm(), 1 * mm);
  }
}

}  // namespace
}  // namespace drape::triangulate
