// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/valleys.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "core/units.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

struct Pinned {
  Scene scene = read_scene(drape::test::source_root() / "rigs/paper/scenes/D.toml");
  Print print = read_print(scene.print_file);
  std::optional<Sheet> nothing;
  Surroundings surroundings{scene};
  ClothLaws laws;
  [[nodiscard]] std::vector<StartChange> starts() const {
    return folded_starts({scene, print, nothing, surroundings, laws});
  }
  /// Shares of the sheet's sides.
  void pin(const std::vector<Vector2d>& places) {
    scene.pins.clear();
    for (const Vector2d& place : places) {
      const Vector2d there = place.cwiseProduct(print.patch_m);
      scene.pins.push_back({{}, Vector3d(0.9 * there.y(), -0.9 * there.x(), 200 * mm), there});
    }
  }
};

TEST(FoldedStarts, AskForTwoPinsWithSheetOnEitherSide) {
  Pinned sheet;
  EXPECT_TRUE(sheet.starts().empty());  // the paper's D: pinned at two corners
  sheet.pin({{0.2, 0.2}, {0.8, 0.2}, {0.5, 0.8}});
  EXPECT_TRUE(sheet.starts().empty());
  sheet.pin({{0.3, 0.2}, {0.4, 0.8}});
  EXPECT_FALSE(sheet.starts().empty());
  sheet.scene.pins[1].point_in_world = *sheet.scene.pins[0].point_in_world + Vector3d(0, 0, 0.1);
  EXPECT_TRUE(sheet.starts().empty());  // no horizontal line
}

/// No longer than the cloth but by its waves, apart from itself, and lower than its pins.
TEST(FoldedStarts, HangDownUnstretchedAndApart) {
  Pinned sheet;
  sheet.pin({{0.3, 0.2}, {0.4, 0.8}});
  const GridSpec grid{21, 21, sheet.print.patch_m};
  const double spacing_m = grid.weft_spacing_m();
  Field before;
  for (const StartChange& start : sheet.starts()) {
    Field x(3 * static_cast<std::size_t>(grid.count()));
    start(grid, x);
    EXPECT_NE(x, before);
    before = x;
    EXPECT_FALSE(passes_through_itself(grid, x));
    double lowest_m = 0, longest_m = 0;
    for (int i = 0; i < grid.count(); ++i) {
      lowest_m = std::min(lowest_m, at(x, i).z() - 200 * mm);
      if (i % grid.cols > 0) longest_m = std::max(longest_m, (at(x, i) - at(x, i - 1)).norm());
    }
    // Half a wave as high as a tenth of its length rises by a tenth of pi.
    EXPECT_LT(longest_m, (1 + 0.1 * std::numbers::pi) * spacing_m);
    EXPECT_GT(longest_m, (1 - 1e-9) * spacing_m);
    // The narrower side is a fifth of the sheet or more.
    EXPECT_LT(lowest_m, -0.15 * sheet.print.patch_m.x());
  }
}

/// Flat, `height` above the pins.
Field flat(const GridSpec& grid, double height) {
  Field x;
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < grid.count(); ++i) {
      const double along[] = {i % grid.cols * grid.weft_spacing_m(),
                              int{i / grid.cols} * grid.warp_spacing_m(), height};
      x.push_back(along[axis]);
    }
  }
  return x;
}

TEST(Kicks, MoveAPartOrJoinPartsOfTwoRests) {
  const GridSpec grid{9, 9, {0.2, 0.2}};
  const Field low = flat(grid, 0), high = flat(grid, 0.1);
  for (int index = 0; index < 40; ++index) {
    const Field start = kicked(grid, index, {&low, &high});
    EXPECT_EQ(start, kicked(grid, index, {&low, &high}));
    EXPECT_NE(start, kicked(grid, index + 1, {&low, &high}));
    const Field alone = kicked(grid, index, {&low});
    for (int i = 0; i < grid.count(); ++i) {
      const Vector3d p = at(start, i);
      EXPECT_LT((p - at(low, i)).head<2>().norm(), 1e-12)
          << index;          // a flat part moves across itself
      if (index % 2 == 0) {  // two rests
        EXPECT_GE(p.z(), 0) << index;
        EXPECT_LE(p.z(), 0.1 + 1e-12) << index;
        EXPECT_LT((at(alone, i) - at(low, i)).norm(), 1e-12) << index;
      }
    }
  }
}

}  // namespace
}  // namespace drape::simulate
