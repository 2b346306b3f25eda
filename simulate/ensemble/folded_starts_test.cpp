// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/branches.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "simulate/ensemble/test_ensemble.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

/// The paper's D, pinned instead at these fractions of the sheet's sides, 10 % closer than flat.
Scene pinned(const std::vector<Vector2d>& places) {
  Scene scene = read_scene(drape::test::source_root() / "rigs/paper/scenes/D.toml");
  if (places.empty()) return scene;
  const Vector2d patch_m = read_print(scene.print_file).patch_m;
  scene.pins.clear();
  for (const Vector2d& place : places) {
    const Vector2d there = place.cwiseProduct(patch_m);
    scene.pins.push_back({{}, Vector3d(0.9 * there.y(), -0.9 * there.x(), 200 * mm), there});
  }
  return scene;
}

std::size_t starts_of(const Scene& scene) {
  return folded_starts(*test::coarse_case(scene).drape).size();
}

TEST(FoldedStarts, AskForTwoPinsWithSheetOnEitherSide) {
  EXPECT_EQ(starts_of(pinned({})), 0U);  // at two corners
  EXPECT_EQ(starts_of(pinned({{0.2, 0.2}, {0.8, 0.2}, {0.5, 0.8}})), 0U);
  Scene two = pinned({{0.3, 0.2}, {0.4, 0.8}});
  EXPECT_EQ(starts_of(two), 8U);
  two.pins[1].point_in_world = *two.pins[0].point_in_world + Vector3d(0, 0, 0.1);
  EXPECT_EQ(starts_of(two), 0U);  // no horizontal line between pins
}

/// Longer than the cloth only by its waves, without self-contact, and below its pins.
TEST(FoldedStarts, HangDownUnstretchedAndApart) {
  const EnsembleCase own = test::coarse_case(pinned({{0.3, 0.2}, {0.4, 0.8}}));
  const DrapeLevel level(*own.drape, own.options.drape, 5 * mm);
  const MaterialMesh& mesh = level.cloth().mesh();
  const double pins_z_m = own.drape->local.scene.pins[0].point_in_world->z();
  MeshCloth::State before;
  for (const DrapeStart& start : folded_starts(*own.drape)) {
    const ClothMoment moment = start(level);
    EXPECT_NE(moment.state, before);
    before = moment.state;
    EXPECT_FALSE(level.meets_itself(moment));
    double lowest_m = 0, longest = 0, shortest = 2;
    for (int i = 0; i < level.cloth().points(); ++i)
      lowest_m = std::min(lowest_m, moment.state[i].z() - pins_z_m);
    for (const MaterialMesh::Edge& edge : mesh.edges) {
      const double stretch = (moment.state[edge.to] - moment.state[edge.from]).norm() /
                             (mesh.points_m[edge.to] - mesh.points_m[edge.from]).norm();
      longest = std::max(longest, stretch);
      shortest = std::min(shortest, stretch);
    }
    // Half a wave with a height of a tenth of its length rises with a slope of a tenth of pi.
    EXPECT_LT(longest, 1 + 0.1 * std::numbers::pi);
    EXPECT_GT(shortest, 0.7) << "a chord of the fold, sheared by the wave";
    // The narrower side is at least a fifth of the sheet.
    EXPECT_LT(lowest_m, -0.15 * own.drape->print.patch_m.x());
  }
}

}  // namespace
}  // namespace drape::simulate
