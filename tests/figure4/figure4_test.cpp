// SPDX-License-Identifier: Apache-2.0
// Tests the statements of rigs/paper/fig4.svg on the sheets that it draws.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/figure4/sphere_drape.hpp"

namespace drape::test {
namespace {

constexpr int kSide = 15;
// Like three standard deviations, taken as more than chance; fixed before the first drape.
constexpr double kFactor = 3;

class Figure4 : public testing::Test {
 protected:
  const SphereScene scene_ = read_sphere_scene();
  const SphereDrape quads_ = drape_grid(scene_, kSide);
};

/// Compared with quads of half the spacing: those of 15 x 15 are so coarse that they hang too low.
TEST_F(Figure4, PlainTrianglesHoldTheClothOut) {
  const SphereDrape fine = drape_grid(scene_, 2 * kSide + 1);
  ASSERT_TRUE(fine.at_rest);
  const double area = plan_area(scene_, fine);
  for (const unsigned seed : {1U, 2U}) {
    const auto mesh = irregular_mesh(scene_.print, kSide, seed);
    const SphereDrape ours = drape_mesh(scene_, mesh, 0.05, kSide);
    const SphereDrape plain = drape_mesh(scene_, mesh, 1, kSide);
    ASSERT_TRUE(ours.at_rest && plain.at_rest);
    EXPECT_GT(plan_area(scene_, plain) - area, kFactor * std::abs(plan_area(scene_, ours) - area))
        << seed;
  }
}

TEST_F(Figure4, DiagonalsThatRunOneDirectionAreSeenInTheDrape) {
  const SphereDrape plain = drape_mesh(scene_, one_diagonal_mesh(scene_.print, kSide), 1, kSide);
  ASSERT_TRUE(quads_.at_rest && plain.at_rest);
  const Asymmetry lacks = asymmetry(plain);
  EXPECT_GT(lacks.middle_mm, kFactor * asymmetry(quads_).middle_mm);
  // The mesh itself has this symmetry, so nothing else may break it.
  EXPECT_GT(lacks.middle_mm, kFactor * lacks.diagonal_mm);
}

}  // namespace
}  // namespace drape::test
