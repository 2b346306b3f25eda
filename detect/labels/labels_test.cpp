// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <Eigen/LU>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "detect/test_pictures.hpp"
#include "tests/support/drawing.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

using namespace detect;

namespace {

TEST(LocalMap, HomographyGivesItsDerivativeAtTheCentre) {
  // A projective map with a known derivative: p = (300 + 4000 x + 500 y, 200 - 300 x + 3500 y) / w.
  const auto project = [](const Eigen::Vector2d& m) -> Eigen::Vector2d {
    const double w = 1 + 2.0 * m.x() - 1.5 * m.y();
    return {(300 + 4000 * m.x() + 500 * m.y()) / w, (200 - 300 * m.x() + 3500 * m.y()) / w};
  };
  const Eigen::Vector2d centre(0.03, 0.05);
  std::array<Eigen::Vector2d, 4> print;
  Eigen::Matrix<double, 2, 4> seen;
  const std::array<Eigen::Vector2d, 4> corners = {
      {{-0.006, -0.006}, {0.006, -0.006}, {0.006, 0.006}, {-0.006, 0.006}}};
  for (int k = 0; k < 4; ++k) {
    print[k] = centre + corners[k];
    seen.col(k) = project(print[k]);
  }
  const auto map = map_at_centre(print, seen, centre);
  ASSERT_TRUE(map.has_value());
  EXPECT_LT((map->centre_px - project(centre)).norm(), 1e-9);
  const double h = 1e-6;
  Eigen::Matrix2d numeric;
  numeric.col(0) =
      (project(centre + Eigen::Vector2d(h, 0)) - project(centre - Eigen::Vector2d(h, 0))) / (2 * h);
  numeric.col(1) =
      (project(centre + Eigen::Vector2d(0, h)) - project(centre - Eigen::Vector2d(0, h))) / (2 * h);
  EXPECT_LT((map->px_per_m - numeric).norm() / numeric.norm(), 1e-6);
  seen.setConstant(5);
  EXPECT_FALSE(map_at_centre(print, seen, centre).has_value());
}

TEST(LocalMap, DotTakesItsRotationFromANeighbourAlsoWhenMirrored) {
  for (const double mirror : {1.0, -1.0}) {
    Eigen::Matrix2d map;
    map << 3000, 800, -500, 1500 * mirror;
    const double radius = 0.002;
    const Eigen::Matrix2d root = symmetric_root(map * map.transpose() * radius * radius) / radius;
    EXPECT_LT((turned_root(root, 1.1 * map) - map).norm() / map.norm(), 1e-9);
  }
}

TEST(LocalMap, StepErrorIsZeroForConstantCurvatureAndOneForTheNextButOne) {
  // Position quadratic in the print coordinate: the trapezoid rule is exact.
  const auto map_at = [](double x) {
    LocalMap map;
    map.centre_px = {4000 * x - 20000 * x * x, 100 * x};
    map.px_per_m << 4000 - 40000 * x, 0, 100, 3500;
    return map;
  };
  EXPECT_LT(step_error(map_at(0), map_at(0.02), {0.02, 0}), 1e-9);
  EXPECT_GT(step_error(map_at(0), map_at(0.04), {0.02, 0}), 0.4);
}

/// A square grid of dots of 3 px, 12 px apart, seen straight on at 3 px per mm.
std::vector<UnlabelledDot> dot_grid(int per_side) {
  std::vector<UnlabelledDot> dots;
  for (int k = 0; k < per_side * per_side; ++k)
    dots.push_back(
        {12.0 * Eigen::Vector2d(k % per_side, k / per_side), 9 * Eigen::Matrix2d::Identity()});
  return dots;
}

TEST(DotSteps, LookAtFewDotsHoweverManyThereAre) {
  for (const int per_side : {10, 100}) {
    const std::vector<UnlabelledDot> dots = dot_grid(per_side);
    const DotSteps steps(dots, 1e-3);
    const std::vector<char> taken(dots.size(), 0);
    for (std::size_t k = 0; k < dots.size(); ++k) {
      const BestStep right =
          steps.best({dots[k].centre_px, 3000 * Eigen::Matrix2d::Identity()}, {4e-3, 0}, taken);
      const bool is_last = k % per_side == static_cast<std::size_t>(per_side) - 1;
      EXPECT_EQ(right.is_clear(), !is_last) << k;
      EXPECT_TRUE(is_last || right.dot == k + 1) << k;
    }
    EXPECT_LT(steps.cells().looked_at(), 60 * dots.size()) << per_side;
  }
}

TEST(Lattice, OfTenThousandDotsIsGrownWhole) {
  PrintPlane plane;
  plane.rows = plane.cols = 100;
  plane.pitch_m = 4e-3;
  plane.dot_radius_m = 1e-3;
  const std::vector<UnlabelledDot> dots = dot_grid(100);
  const auto pieces = grow_pieces(plane, dots, std::vector<char>(dots.size(), 0));
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_EQ(pieces.front().size(), dots.size());
}

TEST(PrintPlane, ClothAndTargetHaveOneFrameWithTheRightHandedness) {
  const Rig rig = read_rig(source_root() / "rigs/bench1/rig.toml");
  const PrintPlane cloth = plane_of(read_print(rig.print_file));
  const PrintPlane target = plane_of(read_target(rig.target_file));
  EXPECT_EQ(cloth.tags.size(), 50U);
  EXPECT_LT((cloth.point_m({0, 0}) - Eigen::Vector2d(0.01, 0.01)).norm(), 1e-12);
  // Tag 1 is in the cell right of (0, 2): x increases along the columns.
  EXPECT_LT((cloth.tags.at(1) - Eigen::Vector2d(0.06, 0.02)).norm(), 1e-12);
  EXPECT_TRUE(cloth.has_tag_in_cell({0, 2}));
  EXPECT_FALSE(cloth.has_tag_in_cell({0, 1}));
  EXPECT_EQ(cloth.marks_around(1).size(), 4U);
  EXPECT_LT((target.point_m({0, 0}) - Eigen::Vector2d(-0.11, -0.08)).norm(), 1e-12);
  // The upper left corner of a target's tag has the larger y, that of a cloth's tag the smaller.
  EXPECT_GT(target.tag_corners_m(400)[0].y(), target.tag_corners_m(400)[3].y());
  EXPECT_LT(cloth.tag_corners_m(1)[0].y(), cloth.tag_corners_m(1)[3].y());
}

}  // namespace

// ----
// Real photographs with tags: test pictures of the AprilTag project with its own results. Tags are
// drawn at these corners, and also searched for in the photographs if available.

namespace {

namespace fs = std::filesystem;

struct KnownTag {
  int id = 0;
  std::array<Eigen::Vector2d, 4> corners_px;
};

/// The corners in photograph `k` as the library finds them without refining edges, from the lower
/// left counter-clockwise, as the tag is read.
std::vector<KnownTag> known_tags(std::size_t k) {
  const Csv file = read_csv(
      test_data("apriltag-photos") / "corners.csv",
      {"photograph", "id", "u0_px", "v0_px", "u1_px", "v1_px", "u2_px", "v2_px", "u3_px", "v3_px"});
  std::vector<KnownTag> tags;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const auto of = [&](std::size_t column) { return file.columns[column][i]; };
    if (of(0) != static_cast<double>(k)) continue;
    tags.push_back({static_cast<int>(of(1)),
                    {Eigen::Vector2d(of(2), of(3)), Eigen::Vector2d(of(4), of(5)),
                     Eigen::Vector2d(of(6), of(7)), Eigen::Vector2d(of(8), of(9))}});
  }
  return tags;
}

/// Black squares with white modules, on grey with a white border.
cv::Mat drawn(const std::vector<KnownTag>& tags, const TagFamily& family) {
  constexpr int kBlack = 30, kWhite = 220;
  const int modules = family.edge_modules();
  Drawing drawing(799, 533, 120);
  for (const KnownTag& tag : tags) {
    const auto& c = tag.corners_px;
    const Eigen::Matrix3d map = *square_homography({c[1], c[0], c[3], c[2]});
    const auto square = [&](int x, int y, int size, int grey) {
      std::vector<Eigen::Vector2d> corners;
      for (const auto& [u, v] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}})
        corners.push_back(
            mapped(map, Eigen::Vector2d(x + u * size - 1, y + v * size - 1) / modules));
      drawing.polygon(corners, grey);
    };
    square(0, 0, modules + 2, kWhite);
    square(1, 1, modules, kBlack);
    for (int y = 1; y <= modules; ++y)
      for (int x = 1; x <= modules; ++x)
        if (!family.black(tag.id, x, y)) square(x, y, 1, kWhite);
  }
  return drawing.picture(0.5);
}

/// Largest distance between corners, for the best of four rotations and two orders of numbering.
double corner_distance(const KnownTag& known, const TagDetection& found) {
  double best = 1e9;
  for (const int sense : {1, 3}) {
    for (int turn = 0; turn < 4; ++turn) {
      double largest = 0;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector2d other = found.corners_px.col((turn + sense * k) % 4);
        largest = std::max(largest, (known.corners_px[k] - other).norm());
      }
      best = std::min(best, largest);
    }
  }
  return best;
}

void expect_all_found(TagFinder& finder, const cv::Mat& picture, const std::vector<KnownTag>& known,
                      double limit_px, const std::string& name) {
  const GreyImage image = image_of(picture);
  const std::vector<TagDetection> found = finder.find_all(image, estimate_noise(image).sigma(128));
  EXPECT_EQ(found.size(), known.size()) << name;
  for (const KnownTag& tag : known) {
    double nearest = 1e9;
    for (const TagDetection& candidate : found) {
      if (candidate.id == tag.id) nearest = std::min(nearest, corner_distance(tag, candidate));
    }
    EXPECT_LE(nearest, limit_px) << name << ": tag at " << tag.corners_px[0].transpose();
  }
}

/// The published corners are from the library without refined edges, as used here. In a drawing
/// such an edge can be half a pixel off, and a corner by that along both of its edges.
TEST(TagPhotos, AllTagsOfThreePhotographsAndNoOther) {
  TagFinder finder("tag36h11");
  const TagFamily family("tag36h11");
  const std::array<std::pair<std::string, std::size_t>, 3> photographs = {
      {{"33369213973_9d9bb4cc96_c", 12},
       {"34085369442_304b6bafd9_c", 25},
       {"34139872896_defdb2f8d9_c", 10}}};
  const auto at_hand = reference_data("apriltag-photos");
  for (std::size_t k = 0; k < photographs.size(); ++k) {
    const auto& [name, count] = photographs[k];
    const std::vector<KnownTag> known = known_tags(k);
    ASSERT_EQ(known.size(), count);
    expect_all_found(finder, drawn(known, family), known, std::sqrt(0.5), name + ", drawn");
    if (at_hand)
      expect_all_found(finder,
                       cv::imread((*at_hand / (name + ".jpg")).string(), cv::IMREAD_GRAYSCALE),
                       known, 0.2, name);
  }
}

}  // namespace
}  // namespace drape::test
