// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "simulate/validation/test_exact.hpp"
#include "simulate/validation/test_sheets.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
constexpr int kUpright = 4;  // Newton steps: a nearly rigid strip gets to rounding in a few

/// Load at which the first direction becomes unstable, by bisection between low and high.
double critical(double low, double high, const std::function<bool(double)>& unstable) {
  for (int i = 0; i < 16; ++i) {
    const double middle = 0.5 * (low + high);
    (unstable(middle) ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

/// A strip standing on its clamped lower end; the second row's hinge stands for half a cell.
TEST(Buckling, OfAnUprightStripUnderItsWeight) {
  const int rows = 41;
  const double h = kLength / (rows - 1.5);
  const GridSpec grid{rows, 2, {h * (rows - 1), h}};
  const double gamma = critical(4, 16, [&](double trial) {
    const double density = trial * kBending / (kGravity * std::pow(kLength, 3));
    Cloth cloth(grid, linear_laws(density, 1e7 * kBending / (kLength * kLength), 1, kBending),
                MassRule::area);
    Field x = shaped(grid, [](double u, double v) { return Vector3d(0, v, u); });
    const std::vector<bool> held = held_rows(grid, {0, 1});
    // First the upright shape under load, sideways motion barred; then its stability.
    std::vector<bool> upright = held;
    for (int i = 0; i < grid.count(); ++i) upright[i] = true;
    const Field load = weight(cloth, {0, 0, -kGravity});
    (void)Equilibrium(cloth, load, upright).find(x, h, kUpright);
    return Equilibrium(cloth, load, held).unstable_directions(x) > 0;
  });
  expect_relative("self-buckling Gamma of an upright strip", exact::kSelfBuckling, gamma, 5e-3);
}

/// rho g L^3 / B at which a strip held on edge by its first two rows falls over sideways.
double edge_load(const GridSpec& grid, double length, double twist) {
  const int n = grid.count();
  std::vector<bool> flat = held_rows(grid, {0, 1}, false), sideways = flat;
  for (int i = 0; i < n; ++i) flat[n + i] = sideways[i] = sideways[2 * n + i] = true;
  return critical(0, 60, [&](double trial) {
    const double density = trial * kBending / (kGravity * std::pow(length, 3));
    const double stiff = 3e7 * kBending / (length * length);  // hardly sags in its own plane
    ClothLaws laws = linear_laws(density, stiff, stiff, kBending);
    laws.bending[1].slope = 1e3 * kBending;  // keeps the cross-section straight
    laws.twist_n_m = twist;
    Cloth cloth(grid, laws, MassRule::area);
    Field x = shaped(grid, [](double u, double v) { return Vector3d(u, 0, v); });
    const Field load = weight(cloth, {0, 0, -kGravity});
    (void)Equilibrium(cloth, load, flat).find(x, grid.warp_spacing_m(), kUpright);
    // In a flat sheet no move within its plane changes the forces across it.
    return Equilibrium(cloth, load, sideways).unstable_directions(x) > 0;
  });
}

/// The moments in a slender cantilever follow from its load alone, so where bending is clamped does
/// not enter: C phi'' + M^2 / B phi = 0 with phi = 0 where twist is clamped. That is the second
/// held row: the cells before it cannot twist, while its hinge bends for half a cell more.
TEST(Buckling, OfAStripOnEdge) {
  const double length = kLength;
  const double fine = length / 199;
  const GridSpec strip{201, 4, {fine * 200, 0.016 * length}};
  // The formula's strip is infinitely slender: what is left are the clamp's hold on the
  // cross-section and the strip's small sag in its own plane.
  expect_relative("lateral buckling load of a strip on edge", exact::kLateralBuckling,
                  edge_load(strip, length, 4 * kBending) / 2, 1e-2);
  const double h = length / 39;
  const GridSpec grid{41, 4, {h * 40, 0.025 * length}};
  expect_at_most("the same load without twist stiffness, over the exact one",
                 edge_load(grid, length, 1e-6 * kBending) / exact::kLateralBuckling, 0.1);
}

/// The load over the width, twist and bending alike in length: both are clamped half a cell before
/// the second held row.
TEST(Buckling, OfAStripOnEdgeOverItsWidth) {
  struct Strip {
    double width, twist;  ///< over length, over bending stiffness
  };
  constexpr int kRows = 101, kCols = 9;
  constexpr double kGoal = 1e-2;
  const double h = kLength / (kRows - 1.5);
  double widest = 0;
  for (const Strip& strip : {Strip{0.05, 2}, {0.1, 2}, {0.2, 2}, {0.2, 0.5}, {0.4, 2}}) {
    const GridSpec grid{kRows, kCols, {h * (kRows - 1), strip.width * kLength}};
    widest = edge_load(grid, kLength, strip.twist * kBending) / std::sqrt(strip.twist);
    expect_relative(
        fmt::format("lateral buckling load, width {:g} L, twist {:g} B", strip.width, strip.twist),
        exact::lateral_buckling(strip.width * strip.width / (12 * strip.twist)), widest, kGoal);
  }
  // The same load in units of half the twist stiffness, or of a strip half as wide, is another.
  EXPECT_GT(std::abs(std::sqrt(2.0) * widest / exact::lateral_buckling(0.4 * 0.4 / 12) - 1),
            20 * kGoal);
  EXPECT_GT(std::abs(widest / exact::lateral_buckling(0.2 * 0.2 / 24) - 1), 10 * kGoal);
}

}  // namespace
}  // namespace drape::simulate
