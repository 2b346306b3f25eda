// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.hpp"
#include "simulate/cloth/drape_coefficient.hpp"
#include "simulate/cloth/test_grid.hpp"
#include "simulate/dynamics/motion.hpp"
#include "simulate/simulate.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

ClothLaws cotton() {
  return linear_laws(0.138, 2000, 30, 7.7e-6, 1e-5);
}

/// Flat, with a smooth bump so that every element is strained.
Field bumpy(const GridSpec& grid) {
  const std::size_t n = grid.count();
  Field x(3 * n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto r = static_cast<double>(std::size_t{i / grid.cols}),
               c = static_cast<double>(i % grid.cols);
    x[i] = c * grid.weft_spacing_m() + 1e-4 * std::sin(3 * r);
    x[n + i] = r * grid.warp_spacing_m() + 1e-4 * std::cos(2 * c + r);
    x[2 * n + i] = 2e-3 * std::sin(0.7 * r + 0.4 * c);
  }
  return x;
}

TEST(Round, ADiscIsCutFromThePatch) {
  const GridSpec grid{41, 41, {0.3, 0.3}, true};
  const Cloth cloth(grid, cotton(), MassRule::area);
  const double disc = std::numbers::pi * 0.15 * 0.15;
  EXPECT_NEAR(cloth.total_mass_kg(), 0.138 * disc, 0.01 * 0.138 * disc);
  EXPECT_EQ(grid.cells_at(0, 0), 0);
  EXPECT_EQ(cloth.mass_kg()[0], 0);
  EXPECT_EQ(grid.cells_at(20, 20), 4);
}

TEST(Round, ForcesAreTheGradientOfTheEnergyAndLeaveTheRestAlone) {
  const GridSpec grid{9, 8, {0.08, 0.07}, true};
  Cloth cloth(grid, cotton(), MassRule::area);
  const Field x = bumpy(grid);
  Field force(x.size(), 0.0);
  cloth.add_forces(x, nullptr, force);
  double largest = 0;
  for (const double f : force) largest = std::max(largest, std::abs(f));
  constexpr double kStep = 1e-7;
  for (std::size_t k = 0; k < x.size(); ++k) {
    Field more = x, less = x;
    more[k] += kStep;
    less[k] -= kStep;
    const double slope =
        (cloth.energies(more).sum_j() - cloth.energies(less).sum_j()) / (2 * kStep);
    EXPECT_NEAR(force[k], -slope, 1e-6 * largest) << k;
    const auto i = static_cast<int>(k % grid.count());
    if (grid.cells_at(i / grid.cols, i % grid.cols) == 0) {
      EXPECT_EQ(force[k], 0);
    }
  }
}

TEST(Round, TheShadowOfAFlatSheetIsItsArea) {
  const GridSpec grid{21, 21, {0.3, 0.3}};
  Field x(3 * static_cast<std::size_t>(grid.count()));
  for (int i = 0; i < grid.count(); ++i) {
    x[i] = 0.8 * (i % 21) * 0.015 + 0.6 * int{i / 21} * 0.015;  // turned
    x[grid.count() + i] = -0.6 * (i % 21) * 0.015 + 0.8 * int{i / 21} * 0.015;
  }
  EXPECT_NEAR(shadow_area_m2(grid, x, 0.5e-3), 0.09, 0.002 * 0.09);
}

TEST(Round, TheDrapemeterGivesACoefficientThatFallsWithTheStiffness) {
  const std::filesystem::path rigs = test::source_root() / "rigs";
  const Scene scene = read_scene(rigs / "physics/scenes/drapemeter_square.toml");
  Fabric fabric = read_fabric(scene.fabric_file);
  SimulateOptions options;
  options.rows = options.cols = 13;
  options.segments = 1;
  options.round = true;
  double before = 0;
  for (const double times : {1.0, 20.0}) {
    Fabric stiffer = fabric;
    for (auto& curve : stiffer.bending) {
      for (double& m : curve.loading) m *= times;
      for (double& m : curve.unloading) m *= times;
    }
    const SimulateResult result =
        simulate(scene, stiffer, read_print(scene.print_file), std::nullopt, options);
    ASSERT_TRUE(result.report.drape_coefficient.has_value());
    EXPECT_NE(result.report.status, RestStatus::diverged);
    EXPECT_GT(*result.report.drape_coefficient, before);
    EXPECT_LT(*result.report.drape_coefficient, 1.0);
    before = *result.report.drape_coefficient;
    ASSERT_FALSE(result.sheet.gaps.empty());
    EXPECT_EQ(result.sheet.gaps.front().reason, "outside the round specimen");
  }
  options.solver = Solver::newton;
  EXPECT_THROW((void)simulate(scene, fabric, read_print(scene.print_file), std::nullopt, options),
               Error);
}

}  // namespace
}  // namespace drape::simulate
