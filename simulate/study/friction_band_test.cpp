// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/friction_band.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "simulate/start/start.hpp"
#include "simulate/study/band.hpp"
#include "simulate/study/branches.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kSunk_m = 2e-6;  // at which a particle presses with its weight
constexpr double kLength_m = 0.4, kStiffness = 50, kDensity = 0.15, kGravity = 9.80665;
constexpr double kHeld = 0.9;  // of the limit, at which the strip lies before it is pushed
// The solver lets friction slip at 0.98 of its limit, and keeps a limit that is 0.95 to 1 of it.
constexpr double kCoulomb = 0.98, kSlack = 0.03;

/// A strip on a table, held at one end and drawn out along x so far that friction has to bear
/// `kHeld` of its limit everywhere: T = kHeld mu rho g (L - x).
FrictionBand pushed_strip(double friction) {
  const GridSpec grid{41, 3, {kLength_m, 0.02}};
  ClothLaws laws;
  laws.density_kg_per_m2 = kDensity;
  for (int k = 0; k < 2; ++k) {
    laws.tensile[k].slope = kStiffness;
    laws.bending[k].slope = 1e-5;
  }
  laws.shear.slope = 20;
  Cloth cloth(grid, laws, MassRule::area);
  Surroundings table;
  table.add(Table{0.0});
  StaticOptions options;
  options.friction = friction;
  options.contact_between_particles = false;
  StaticSolver solver(cloth, table, options);
  solver.position.assign(3 * static_cast<std::size_t>(grid.count()), 0.0);
  std::vector<Hold> holds;
  std::vector<Vector3d> held;
  const double pull = kHeld * friction * kDensity * kGravity / kStiffness;
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      const double x = r * grid.warp_spacing_m(), y = c * grid.weft_spacing_m();
      const Vector3d place(x + pull * (kLength_m * x - 0.5 * x * x), y, -kSunk_m);
      put_at(solver.position, grid.index(r, c), place);
      if (r > 0) continue;
      holds.push_back(hold_at(grid, {x, y}));
      held.push_back(place);
    }
  }
  solver.contacts().hold(holds, held);
  EXPECT_EQ(solver.solve().status, StaticStatus::at_rest);
  return push_at_rest(solver, options);
}

/// How far a push left the middle of the free end along the strip.
double along_m(const FrictionBand& band, std::size_t push) {
  const int tip = 40 * 3 + 1;
  return (at(band.pushes[push].position, tip) - at(band.rest, tip)).x();
}

// Pushed by p towards its held end the strip slides where friction has to bear T' + p, and stays
// there: T' = limit - p. Lifted by p it slides where its weight times 1 - p bears less than T'. In
// the other directions nothing is over the limit, and it comes back. The end of a strip whose pull
// falls by dT' moves by dT' L^2 / 2 K.
TEST(FrictionBand, OfAStripOnATableIsThatOfCoulombsLaw) {
  double before_m = 0;
  for (const double friction : {0.1, 0.2, 0.4}) {
    const FrictionBand band = pushed_strip(friction);
    ASSERT_EQ(band.pushes.size(), 6U);
    for (const FrictionPush& push : band.pushes) EXPECT_TRUE(push.counts()) << push.ending;
    const double per_limit_m =
        kDensity * kGravity * kLength_m * kLength_m / (2 * kStiffness) * friction;
    const double pull_m = at(band.rest, 40 * 3 + 1).x() - kLength_m;
    EXPECT_NEAR(pull_m, kHeld * per_limit_m, kSlack * per_limit_m) << friction;
    const double inward_m = (kHeld + 0.5 - kCoulomb) * per_limit_m;
    const double lifted_m = (kHeld - kCoulomb * (1 - 0.5 * friction)) * per_limit_m;
    EXPECT_NEAR(-along_m(band, 0), inward_m, kSlack * per_limit_m) << friction;
    EXPECT_NEAR(along_m(band, 1), 0, 0.01 * per_limit_m) << friction;
    EXPECT_NEAR(-along_m(band, 5), std::max(lifted_m, 0.0), kSlack * per_limit_m) << friction;
    EXPECT_NEAR(along_m(band, 4), 0, 0.01 * per_limit_m) << friction;
    EXPECT_GT(-along_m(band, 0), 1.9 * before_m);
    before_m = -along_m(band, 0);
  }
}

TEST(FrictionBand, WithoutFrictionThereIsNone) {
  const FrictionBand band = pushed_strip(0);
  EXPECT_TRUE(band.pushes.empty());
}

BranchResult drapes(const std::string& scene, int threads) {
  Scene drawn = read_scene(test::source_root() / "rigs/bench1/scenes" / (scene + ".toml"));
  drawn.start.mode = StartMode::flat;
  drawn.start.centre_in_world = Vector3d(0.005, -0.004, Surroundings(drawn).top_z_m() + 0.003);
  SimulateOptions options;
  options.rows = options.cols = 11;
  options.segments = 1;
  options.solver = "fall";
  options.threads = threads;
  return simulate_branches(drawn, read_fabric(drawn.fabric_file), read_print(drawn.print_file),
                           std::nullopt, options, {.starts = 4});
}

TEST(FrictionBand, HoldsTheRestAndIsTheSameOnTwoThreads) {
  const Print print = read_print(test::source_root() / "rigs/bench1/print.toml");
  const GridSpec grid{11, 11, print.patch_m};
  Json one, two;
  const BranchResult first = drapes("C", 1);
  ASSERT_TRUE(first.branches.friction_band.has_value());
  add_friction_band(*first.branches.friction_band, grid, print, one);
  add_friction_band(*drapes("C", 2).branches.friction_band, grid, print, two);
  EXPECT_EQ(one.dump(), two.dump());
  const Json& band = one["friction_band"];
  EXPECT_EQ(band["pushes"].size(), 6U);
  ASSERT_EQ(band["marks"].size(), static_cast<std::size_t>(print.rows * print.cols));
  EXPECT_EQ(first.branches.friction_band->rest, first.branches.members.front());
  for (const Json& mark : band["marks"]) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LE(mark["low_mm"][axis].get<double>(), mark["rest_mm"][axis].get<double>());
      EXPECT_GE(mark["high_mm"][axis].get<double>(), mark["rest_mm"][axis].get<double>());
    }
  }
}

}  // namespace
}  // namespace drape::simulate
