// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "core/rig.hpp"
#include "detect/labels/labels.hpp"
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
}  // namespace drape::test
