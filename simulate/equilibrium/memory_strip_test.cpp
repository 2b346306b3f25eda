// SPDX-License-Identifier: Apache-2.0
// Strips with internal friction against closed form and boundary-value problem.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/start/history.hpp"
#include "tests/support/heavy_strip.hpp"

namespace drape::simulate {
namespace {

using namespace test;

/// Goes to rest with the first two rows held; how it ends.
StaticStatus settle_down(Cloth& cloth, const Eigen::Vector3d& gravity, Field& x,
                         double tolerance = 1e-5) {
  StaticOptions options;
  options.gravity_m_per_s2 = gravity;
  options.residual_tolerance = tolerance;
  options.first_step_s = 0.1;
  options.judge_stability = false;
  const Surroundings nothing;
  StaticSolver solver(cloth, nothing, options);
  std::vector<Hold> holds;
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < 2 * cloth.grid().cols; ++i) {
    holds.push_back({{i, i, i, i}, {1, 0, 0, 0}});
    places.push_back(at(x, i));
  }
  solver.contacts().hold(holds, places);
  solver.position = x;
  const StaticReport report = solver.solve();
  x = solver.position;
  return report.status;
}

/// Mean turn per length over the free rows (1/m), from the angles between the grid's edges.
double mean_curvature(const GridSpec& grid, const Field& x) {
  double turned = 0;
  for (int r = 1; r + 1 < grid.rows; ++r) {
    const Eigen::Vector3d before = at(x, grid.index(r, 0)) - at(x, grid.index(r - 1, 0));
    const Eigen::Vector3d after = at(x, grid.index(r + 1, 0)) - at(x, grid.index(r, 0));
    turned += std::atan2(before.cross(after).norm(), before.dot(after));
  }
  return turned / ((grid.rows - 2) * grid.warp_spacing_m());
}

/// Rolled to `curvature`, let go without gravity, and what curvature is left.
double left_of(double curvature, double friction_moment) {
  const int rows = 41;
  const double spacing = 1e-3;
  const GridSpec grid{rows, 2, {spacing * (rows - 1), spacing}};
  Cloth cloth(grid, cotton(grid.patch_m.x(), friction_moment), MassRule::area);
  Field x(3 * static_cast<std::size_t>(grid.count()));
  const double turn = 2 * std::asin(0.5 * curvature * spacing);  // so that the edges keep length
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < 2; ++c) put_at(x, grid.index(r, c), p + Eigen::Vector3d(0, c * spacing, 0));
    p += spacing * Eigen::Vector3d(std::cos(turn * r), 0, -std::sin(turn * r));
  }
  cloth.settle(x);
  // Residuals are counted in weights: a little gravity, across the strip, bends nothing.
  EXPECT_EQ(settle_down(cloth, {0, 1e-4 * kGravity, 0}, x, 1e-3), StaticStatus::at_rest);
  return mean_curvature(grid, x);
}

TEST(MemoryStrip, ReleasedStripKeepsItsResidualCurvature) {
  for (const double fraction : {1.0, 0.5}) {
    const double moment = fraction * kFrictionMoment;
    const double exact = moment / kStiffness;  // 2HB / (2 B)
    for (const double sign : {1.0, -1.0})
      EXPECT_NEAR(left_of(sign * 1.5 * units::per_cm, moment), exact, 1e-3 * exact);
  }
}

TEST(MemoryStrip, HeavyCantileverLoadedAndUnloaded) {
  constexpr double kLength = 0.08;
  constexpr int kRows = 162, kSteps = 10;
  const double spacing = kLength / (kRows - 1.5);  // the clamp is half a cell before row 1
  const GridSpec grid{kRows, 2, {spacing * (kRows - 1), spacing}};
  Cloth cloth(grid, cotton(kLength, kFrictionMoment), MassRule::area);
  Field x(3 * static_cast<std::size_t>(grid.count()));
  for (int i = 0; i < grid.count(); ++i)
    put_at(x, i, Eigen::Vector3d(int{i / 2} * spacing, i % 2 * spacing, 0));
  HeavyStrip exact(kLength);
  std::vector<double> loads;
  for (int k = 1; k <= kSteps; ++k) loads.push_back(1.0 * k / kSteps);
  for (int k = kSteps - 1; k >= 1; --k) loads.push_back(1.0 * k / kSteps);
  double loaded_height = 0;
  for (std::size_t k = 0; k < loads.size(); ++k) {
    const double gravity = loads[k] * kGravity;
    ASSERT_EQ(settle_down(cloth, {0, 0, -gravity}, x), StaticStatus::at_rest) << loads[k];
    exact.load(kDensity * gravity);
    const Eigen::Vector3d tip = at(x, grid.index(kRows - 1, 0));
    const double width = tip.x() - 0.5 * spacing, height = -tip.z();
    EXPECT_NEAR(height, -exact.z, 3e-3 * -exact.z) << loads[k];
    EXPECT_NEAR(width, exact.x, 3e-3 * exact.x) << loads[k];
    if (k + 1 == kSteps) loaded_height = height;
  }
  // Friction holds it: unloaded to a tenth, an elastic strip would hang far higher.
  EXPECT_GT(-exact.z, 0.5 * loaded_height);
  EXPECT_GT(cloth.dissipated_j(), 0);
}

/// Signed by the side of the printed face that the free end stands on.
double curl_of(const std::vector<std::string>& history) {
  constexpr int kRows = 41;
  constexpr double kSpacing = 1e-3;
  const StaticDrape drape =
      ClampedStrip(history, {1e-4 * kGravity, 0, 0}, kRows, kSpacing).drape(1e-3);
  EXPECT_EQ(drape.report.status, StaticStatus::at_rest);
  const double size =
      mean_curvature({kRows, 2, {kSpacing * (kRows - 1), kSpacing}}, drape.position);
  return std::copysign(size, at(drape.position, 2 * kRows - 1).z());
}

/// Laid flat, its elements are at their limit: they and the elastic curve divide what is left.
TEST(History, AStripThatWasBentAndLaidFlatKeepsWhatItsElementsHold) {
  const double exact = kFrictionMoment / (kStiffness + kFrictionMoment / kSlipCurvature);
  EXPECT_NEAR(curl_of({"bent 1.5 per cm along warp"}), exact, 1e-3 * exact);
  EXPECT_NEAR(curl_of({"bent -1.5 per cm along warp"}), -exact, 1e-3 * exact);
  EXPECT_NEAR(curl_of({"bent 1.5 per cm along warp", "bent -2 per cm along warp"}), -exact,
              1e-3 * exact);
  EXPECT_NEAR(curl_of({"bent 1.5 per cm along warp", "flat"}), 0, 1e-3 * exact);
  EXPECT_NEAR(curl_of({"bent 1.5 per cm along weft"}), 0, 1e-3 * exact);
}

/// Loops close, so a strip that was laid flat comes back to where it hung; shaken, it sags to where
/// the law's boundary-value problem has it after the same loads.
TEST(History, ADrapedStripComesBackAndAShakenOneSags) {
  constexpr double kLength = 0.08;
  constexpr int kRows = 162;
  const double spacing = kLength / (kRows - 1.5);
  const auto height_after = [&](const std::vector<std::string>& history) {
    const StaticDrape drape = ClampedStrip(history, {0, 0, -kGravity}, kRows, spacing).drape(1e-5);
    EXPECT_EQ(drape.report.status, StaticStatus::at_rest);
    return -at(drape.position, 2 * kRows - 1).z();
  };
  HeavyStrip exact(kLength);
  exact.load(kDensity * kGravity);
  const double fresh = -exact.z;
  for (const double load : {1.5, 0.5, 1.5, 0.5, 1.0}) exact.load(load * kDensity * kGravity);
  const double shaken = -exact.z;
  EXPECT_GT(shaken, 1.02 * fresh);
  EXPECT_NEAR(height_after({}), fresh, 3e-3 * fresh);
  EXPECT_NEAR(height_after({"draped 1 times"}), fresh, 3e-3 * fresh);
  EXPECT_NEAR(height_after({"draped 1 times", "shaken 2 times"}), shaken, 3e-3 * shaken);
}

TEST(History, WhatIsNoEventIsRefusedWithFileAndField) {
  Scene scene;
  scene.file = "scenes/C.toml";
  for (const char* text : {"",
                           "folded",
                           "bent",
                           "bent 1.5",
                           "bent 1.5 per mm along warp",
                           "bent x per cm along warp",
                           "bent nan per cm along warp",
                           "bent 0 per cm along warp",
                           "bent 21 per cm along warp",
                           "bent 1e999 per cm along weft",
                           "bent 1.5 per cm along bias",
                           "draped",
                           "draped 0 times",
                           "draped -1 times",
                           "draped 1.5 times",
                           "draped 51 times",
                           "draped 1e9 times",
                           "shaken 3 times by 0 %",
                           "shaken 3 times by 96 %",
                           "shaken 3 times by -5 %",
                           "shaken 3 times by 40",
                           "flat flat",
                           "Flat"}) {
    scene.start.history = {"flat", text};
    try {
      static_cast<void>(history_of(scene));
      ADD_FAILURE() << "`" << text << "` is taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.where().file, "scenes/C.toml");
      EXPECT_EQ(error.where().field, "start.history");
      EXPECT_THAT(error.what(), ::testing::HasSubstr(text));
    }
  }
  scene.start.history = {"shaken 3 times", "flat"};
  EXPECT_THROW(static_cast<void>(history_of(scene)), Error) << "shaken before something else";
  scene.start.history = {"flat", "bent -0.5 per cm along weft", "draped 3 times",
                         "shaken 5 times by 40 %"};
  const std::vector<PastEvent> events = history_of(scene);
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[1].direction, 1);
  EXPECT_DOUBLE_EQ(events[1].curvature_per_m, -50);
  EXPECT_EQ(events[2].times, 3);
  EXPECT_EQ(shakes_of(events).times, 5);
  EXPECT_DOUBLE_EQ(shakes_of(events).part, 0.4);
}

/// A sheet pinned at two corners falls by Runge-Kutta, undamped: what it loses is what friction
/// took.
TEST(MemoryStrip, EnergyOfAFallBalances) {
  const GridSpec grid{9, 9, {0.08, 0.08}};
  ClothLaws laws = cotton(0.08, kFrictionMoment);
  laws.tensile[0] = laws.tensile[1] = {200, {}};
  laws.friction->shear = {{{20, 0.1, 1}}};
  laws.shear = {10, {}};
  Cloth cloth(grid, laws, MassRule::area);
  const Surroundings nothing;
  Motion motion(cloth, nothing, {});
  for (int i = 0; i < grid.count(); ++i)
    put_at(motion.position, i,
           Eigen::Vector3d(int{i / 9} * 0.01, i % 9 * 0.01, 1e-4 * std::sin(7.0 * i)));
  motion.hold({{{0, 0, 0, 0}, {1, 0, 0, 0}}, {{8, 8, 8, 8}, {1, 0, 0, 0}}});
  const auto energy = [&] {
    return motion.kinetic_energy_j() + motion.gravity_energy_j() +
           cloth.energies(motion.position).sum_j();
  };
  const double before = energy();
  double time_s = 0;
  while (time_s < 0.25) {
    time_s += motion.step(motion.stable_step_s(0.3));
  }
  EXPECT_GT(cloth.dissipated_j(), 0);
  EXPECT_NEAR(before - energy(), cloth.dissipated_j(), 1e-3 * cloth.dissipated_j());
}

}  // namespace
}  // namespace drape::simulate
