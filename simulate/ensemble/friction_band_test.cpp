// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/friction_band.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "simulate/ensemble/band.hpp"
#include "simulate/ensemble/branches.hpp"
#include "simulate/start/start.hpp"
#include "simulate/study/split.hpp"
#include "tests/support/heavy_strip.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kSunk_m = 2e-6;  // at which a particle presses with its weight
constexpr double kLength_m = 0.4, kStiffness = 50, kDensity = 0.15, kGravity = 9.80665;
constexpr double kHeld = 0.9;  // relative to the limit, at which the strip lies before it is pushed
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

/// Distance by which a push left the middle of the free end along the strip.
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
  Scene drawn = read_scene(drape::test::source_root() / "rigs/bench1/scenes" / (scene + ".toml"));
  drawn.start.mode = StartMode::flat;
  drawn.start.centre_in_world = Vector3d(0.005, -0.004, Surroundings(drawn).top_z_m() + 0.003);
  SimulateOptions options;
  options.rows = options.cols = 11;
  options.segments = 1;
  options.solver = Solver::fall;
  options.threads = threads;
  return simulate_branches(drawn, read_fabric(drawn.fabric_file), read_print(drawn.print_file),
                           std::nullopt, options, {.starts = 4});
}

TEST(FrictionBand, HoldsTheRestAndIsTheSameOnTwoThreads) {
  const Print print = read_print(drape::test::source_root() / "rigs/bench1/print.toml");
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

/// The tip of a heavy cantilever after other pasts, against the boundary-value problem with the
/// same law through the same loads.
TEST(MemoryBand, OfACantileverIsThatOfTheLawsBoundaryValueProblem) {
  constexpr double kStripLength = 0.08;
  constexpr int kRows = 162;
  const double spacing = kStripLength / (kRows - 1.5);
  const test::ClampedStrip strip({}, {0, 0, -kGravity}, kRows, spacing);
  std::optional<MemoryBand> found;
  const StaticDrape drape =
      strip.drape(1e-5, [&](StaticSolver& solver, const StaticReport& report) {
        ClothLaws without = strip.the_case().laws;
        without.friction.reset();
        found = ends_of_memory(strip.the_case(), without, strip.grid(), solver, strip.options(1e-5),
                               report, {0.5, 1});
        EXPECT_EQ(solver.position, found->rest) << "the solver is left as it was";
      });
  ASSERT_TRUE(found);
  EXPECT_EQ(drape.position, found->rest);
  const auto height = [&](const Field& x) { return -at(x, 2 * kRows - 1).z(); };
  const auto exact_after = [&](const std::vector<double>& loads, double friction_moment) {
    test::HeavyStrip exact(kStripLength, friction_moment);
    for (const double load : loads) exact.load(load * test::kDensity * kGravity);
    return -exact.z;
  };
  const double fresh = exact_after({1}, test::kFrictionMoment);
  const double pressed = exact_after({1, 1.5, 1}, test::kFrictionMoment);
  const double lifted = exact_after({1, 0.5, 1}, test::kFrictionMoment);
  const double elastic = exact_after({1}, 0);
  EXPECT_GT(pressed, 1.02 * fresh);
  EXPECT_NEAR(height(found->rest), fresh, 3e-3 * fresh);
  const auto expect_end = [&](const std::string& what, double up, double exact) {
    const auto end = std::find_if(found->ends.begin(), found->ends.end(), [&](const auto& one) {
      return one.what == what &&
             one.push_per_weight.value_or(Vector3d::Zero()).isApprox(Vector3d(0, 0, up), 1e-9);
    });
    ASSERT_NE(end, found->ends.end()) << what;
    EXPECT_TRUE(end->counts()) << what << ": " << end->ending;
    EXPECT_NEAR(height(end->position), exact, 3e-3 * exact) << what << " " << up;
  };
  expect_end("without internal friction, from there", 0, elastic);
  expect_end("pushed and let go", -0.5, pressed);
  expect_end("pushed and let go", 0.5, lifted);
  expect_end("draped once more", 0, fresh);
  // Loaded without a turn, it hangs as high as friction can hold it.
  ASSERT_TRUE(found->place_of_rest());
  EXPECT_GT(*found->place_of_rest(), 0.95);
}

TEST(MemoryBand, HoldsTheRestOfADrapeWithAHistory) {
  Scene scene = read_scene(drape::test::source_root() / "rigs/bench1/scenes/C.toml");
  scene.start.mode = StartMode::flat;
  scene.start.centre_in_world = Vector3d(0.005, -0.004, Surroundings(scene).top_z_m() + 0.003);
  scene.start.history = {"draped 1 times"};
  const Fabric fabric = read_fabric(scene.fabric_file);
  const Print print = read_print(scene.print_file);
  SimulateOptions options;
  options.rows = options.cols = 11;
  options.solver = Solver::fall;
  options.internal_friction = true;
  const BranchResult found =
      simulate_branches(scene, fabric, print, std::nullopt, options, {.starts = 2});
  ASSERT_FALSE(found.sheets.empty());
  ASSERT_TRUE(found.branches.memory_band);
  Json json;
  add_memory_band(*found.branches.memory_band, {11, 11, print.patch_m}, print, json);
  const Json& band = json["internal_friction_band"];
  ASSERT_EQ(band["ends"].size(), 5U) << "elastic, pressed, lifted, once more, without history";
  EXPECT_EQ(band["ends"][0]["ending"], "at rest") << "by the laws that the checker takes";
  double widest = 0;
  for (const Json& mark : band["marks"]) {
    for (int axis = 0; axis < 3; ++axis) {
      const double low = mark["low_mm"][axis], high = mark["high_mm"][axis];
      EXPECT_LE(low, mark["rest_mm"][axis].get<double>());
      EXPECT_GE(high, mark["rest_mm"][axis].get<double>());
      widest = std::max(widest, high - low);
    }
  }
  EXPECT_GT(widest, 0.1) << "mm";
  EXPECT_GE(band["place_of_rest"].get<double>(), 0);
  EXPECT_LE(band["place_of_rest"].get<double>(), 1);
  EXPECT_EQ(found.branches.memory_band->rest, found.branches.members.front());
}

/// The loops' part of the error split is what the drape with them makes of the one without.
TEST(MemoryBand, TheErrorSplitHoldsTheLoops) {
  Scene scene = read_scene(drape::test::source_root() / "rigs/bench1/scenes/C.toml");
  scene.start.mode = StartMode::flat;
  scene.start.centre_in_world = Vector3d(0.005, -0.004, Surroundings(scene).top_z_m() + 0.003);
  const Fabric fabric = read_fabric(scene.fabric_file);
  const Print print = read_print(scene.print_file);
  SimulateOptions options;
  options.rows = options.cols = 11;
  options.solver = Solver::newton;
  const Sheet reference = simulate(scene, fabric, print, std::nullopt, options).sheet;
  const ErrorSplit split =
      split_error(scene, fabric, print, std::nullopt, reference, options,
                  {.starts = 1, .only_first_order = true, .scene_values = true});
  const auto loops = std::find_if(split.scene.begin(), split.scene.end(), [](const auto& effect) {
    return effect.value == "internal_friction";
  });
  ASSERT_NE(loops, split.scene.end());
  ASSERT_TRUE(loops->change_per_unit);
  EXPECT_GT(*loops->change_per_unit, 1e-5) << "m, off the drape without";
  EXPECT_GE(loops->moves.up_m.rowwise().norm().mean(), *loops->change_per_unit)
      << "a distance changes by no more than its mark moves";
  EXPECT_EQ(loops->moves.down_m, -loops->moves.up_m);
  EXPECT_DOUBLE_EQ(loops->moves.half_width.value_or(0), 1);
}

}  // namespace
}  // namespace drape::simulate
