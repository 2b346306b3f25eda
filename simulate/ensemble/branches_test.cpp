// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/branches.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/units.hpp"
#include "simulate/ensemble/linkage.hpp"
#include "simulate/test_drape.hpp"

namespace drape::simulate {
namespace {

using units::mm;

BranchResult search(const Scene& scene, const SimulateOptions& options, int starts) {
  return simulate_branches(scene, read_fabric(scene.fabric_file), read_print(scene.print_file),
                           std::nullopt, options, {.starts = starts});
}

TEST(Branches, AreRankedAtRestAndTheSameOnTwoThreads) {
  SimulateOptions options = options_of(11, Solver::rk4);
  const BranchResult one = search(lying_scene("A", 0), options, 6);
  options.threads = 2;
  const BranchResult two = search(lying_scene("A", 0), options, 6);
  EXPECT_TRUE(one.branches.round);
  ASSERT_FALSE(one.sheets.empty());
  std::size_t starts = one.branches.not_at_rest.size();
  for (std::size_t k = 0; k < one.sheets.size(); ++k) {
    const Branch& branch = one.branches.found[k];
    starts += branch.starts.size();
    EXPECT_LE(branch.report.residual, 1e-6);
    if (k > 0) {
      EXPECT_GE(branch.energy_j, one.branches.found[k - 1].energy_j);
    }
    for (std::size_t j = 0; j < k; ++j) {
      EXPECT_GE(mean_distance_m(branch.position, one.branches.found[j].position, true), 1e-3);
    }
  }
  EXPECT_EQ(starts, 6U);
  EXPECT_EQ(branches_json(one.branches).dump(), branches_json(two.branches).dump());
}

// A coarse sheet that touches with its particles only is cut by the cube's edges.
TEST(Branches, WhatLiesInAnObjectIsNamedAndIsNoBranch) {
  SimulateOptions options = options_of(7, Solver::newton);
  options.contact_between_particles = false;
  const BranchResult result = search(lying_scene("C", 0), options, 2);
  EXPECT_TRUE(result.branches.found.empty());
  EXPECT_TRUE(result.sheets.empty());
  ASSERT_FALSE(result.branches.refused.empty());
  EXPECT_NE(result.branches.refused.front().why.find("inside an object"), std::string::npos)
      << result.branches.refused.front().why;
}

TEST(Branches, ASheetTurnedAboutARoundObjectIsTheSame) {
  const GridSpec grid{7, 7, {0.2, 0.2}};
  const std::size_t n = grid.count();
  Field a(3 * n);
  Field b(3 * n);
  for (std::size_t i = 0; i < n; ++i) {
    const double x = 0.03 * static_cast<double>(std::size_t{i / 7}) - 0.07;
    const double y = 0.02 * static_cast<double>(i % 7);
    const double z = x * y + 3 * x * x;
    a[i] = x, a[n + i] = y, a[2 * n + i] = z;
    b[i] = x * std::cos(1.1) - y * std::sin(1.1);
    b[n + i] = x * std::sin(1.1) + y * std::cos(1.1);
    b[2 * n + i] = z;
  }
  EXPECT_LT(mean_distance_m(a, b, true), 1e-12);
  EXPECT_GT(mean_distance_m(a, b, false), 0.01);
}

TEST(Branches, AreWhatGapsSeparate) {
  const auto on_a_line = [](const std::vector<double>& x) {
    return link(
        static_cast<int>(x.size()), [x](int a, int b) { return std::abs(x[a] - x[b]); }, 0.5);
  };
  const Linkage two = on_a_line({0, 10, 1.1, 2, 11, 3.2, 12.1});
  EXPECT_EQ(two.group, (std::vector<int>{0, 1, 0, 0, 1, 0, 1}));
  EXPECT_LT(two.limit, 6.8);
  const Linkage dense = on_a_line({0, 3, 1, 2, 4, 5});
  EXPECT_EQ(dense.group, std::vector<int>(6, 0));
  EXPECT_EQ(on_a_line({0, 0.4}).group, (std::vector<int>{0, 0}));
  EXPECT_EQ(link(0, {}, 0.5).group, std::vector<int>());
}

TEST(Branches, TheHemsFoldsAreCounted) {
  const GridSpec grid{21, 21, {0.2, 0.2}};
  const std::size_t n = grid.count();
  Field sheet(3 * n);
  for (std::size_t i = 0; i < n; ++i) {
    const double u = static_cast<double>(std::size_t{i / 21}) / 10.0 - 1;
    const double v = static_cast<double>(i % 21) / 10.0 - 1;
    const double out = std::max(std::abs(u), std::abs(v));
    // The same fraction of the border as seen from the middle of the sheet.
    double fraction = 0;
    if (out > 0) {
      if (u == -out) fraction = (v / out + 1) / 8;
      if (v == out) fraction = (u / out + 1) / 8 + 0.25;
      if (u == out) fraction = (1 - v / out) / 8 + 0.5;
      if (v == -out && u != -out) fraction = (1 - u / out) / 8 + 0.75;
    }
    const double angle = 2 * std::numbers::pi * fraction;
    const double radius = out * (0.08 + 0.01 * std::cos(5 * angle));
    sheet[i] = radius * std::cos(angle);
    sheet[n + i] = radius * std::sin(angle);
  }
  const HemLabel label = label_hem(grid, sheet);
  EXPECT_EQ(label.nodes, 5);
  EXPECT_NEAR(label.amplitude_m[5] / mm, 10, 0.5);
  EXPECT_NEAR(label.amplitude_m[0] / mm, 80, 0.5);
}

}  // namespace
}  // namespace drape::simulate
