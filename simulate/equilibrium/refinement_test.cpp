// SPDX-License-Identifier: Apache-2.0
// A square sheet clamped along one edge in a sideways and downward gravity, in which stretch,
// shear, bending along both threads and twist all work, on ever finer grids. Each starts from the
// coarser one, so that all stay on one branch. Eleven points of the free edge are compared. (A
// sheet hung from single points has no such limit: the shear around a point load grows with the
// logarithm of the number of particles.)
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <vector>

#include "core/units.hpp"
#include "simulate/equilibrium/prolong.hpp"
#include "simulate/equilibrium/solver.hpp"
#include "simulate/start/start.hpp"
#include "simulate/validation/test_sheets.hpp"
#include "tests/support/trials.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

constexpr double kLength_m = 0.06;
constexpr double kTable_m = -1;  // far below; near zero the coordinates are finest
constexpr int kCommon = 11;
// A particle of 201 x 201 weighs 0.1 uN, and the pins' stiffness rounds to a millionth of that.
constexpr double kResidual = 1e-5;

struct Clamped {
  int cells = 0;
  GridSpec grid;
  StaticReport report;
  Field position;
};

/// The clamp line lies half a cell before the second row.
double spacing_m(int cells) {
  return kLength_m / (cells + 0.5);
}

Clamped rest(int cells, const Clamped* coarser) {
  const double h = spacing_m(cells);
  Clamped sheet{cells, {cells + 2, cells + 1, {h * (cells + 1), kLength_m}}, {}, {}};
  ClothLaws laws = linear_laws(0.138, 300, 20, 7.7e-6);
  laws.bending[1].slope = 5e-6;
  laws.twist_n_m = 1.1e-5;
  Cloth cloth(sheet.grid, laws, MassRule::area);
  Scene scene;
  scene.table_z_m = kTable_m;
  const Surroundings nothing(scene);
  StaticOptions how;
  how.gravity_m_per_s2 = {0, 0.5 * 9.80665, -0.8 * 9.80665};
  how.residual_tolerance = kResidual;
  how.paced = coarser == nullptr;
  if (!how.paced) how.first_step_s = 0.03;
  StaticSolver solver(cloth, nothing, how);
  std::vector<Hold> holds;
  std::vector<Vector3d> in_world;
  for (int r = 0; r < 2; ++r) {
    for (int c = 0; c <= cells; ++c) {
      holds.push_back(hold_at(sheet.grid, {r * h, c * kLength_m / cells}));
      in_world.emplace_back((r - 0.5) * h, c * kLength_m / cells, 0);
    }
  }
  solver.contacts().hold(holds, in_world);
  solver.position =
      coarser != nullptr
          ? prolong(coarser->position, coarser->grid, sheet.grid)
          : shaped(sheet.grid, [h](double u, double v) { return Vector3d(u - 0.5 * h, v, 0); });
  sheet.report = solver.solve();
  sheet.position = solver.position;
  EXPECT_EQ(sheet.report.status, StaticStatus::at_rest) << cells;
  EXPECT_TRUE(sheet.report.stable) << cells;
  return sheet;
}

double distance_between_m(const Clamped& a, const Clamped& b) {
  const auto point = [](const Clamped& sheet, int k) {
    const auto n = static_cast<std::size_t>(sheet.grid.count());
    const auto i = static_cast<std::size_t>(
        sheet.grid.index(sheet.grid.rows - 1, k * (sheet.cells / (kCommon - 1))));
    return Vector3d(sheet.position[i], sheet.position[n + i], sheet.position[2 * n + i]);
  };
  double sum = 0;
  for (int k = 0; k < kCommon; ++k) sum += (point(a, k) - point(b, k)).norm();
  return sum / kCommon;
}

/// Order p for which the error C h^p of three grids gives the ratio of their two distances.
double order_of(const Clamped& coarse, const Clamped& middle, const Clamped& fine) {
  const double ratio = distance_between_m(coarse, middle) / distance_between_m(middle, fine);
  const auto power = [](const Clamped& sheet, double p) {
    return std::pow(spacing_m(sheet.cells), p);
  };
  double low = 0.1;
  double high = 6;
  for (int k = 0; k < 60; ++k) {
    const double p = 0.5 * (low + high);
    const double found =
        (power(coarse, p) - power(middle, p)) / (power(middle, p) - power(fine, p));
    (found < ratio ? low : high) = p;
  }
  return 0.5 * (low + high);
}

// A slice of three grids in every run; up to 202x201 with DRAPE_LONG_TESTS=1.
TEST(Refinement, OfAClampedSheetIsOfSecondOrderOnOneBranch) {
  const std::vector<int> cells{10, 20, 40, 100, 200};
  const int count = test::trial_count(3, static_cast<int>(cells.size()));
  std::vector<Clamped> sheets;
  for (int k = 0; k < count; ++k) {
    sheets.push_back(rest(cells[k], k == 0 ? nullptr : &sheets[k - 1]));
    const Clamped& now = sheets.back();
    std::cout << "  " << now.grid.rows << "x" << now.grid.cols << ": residual "
              << now.report.residual << ", " << now.report.iterations << " steps";
    if (k > 0)
      std::cout << ", mean distance from the coarser "
                << distance_between_m(sheets[k - 1], now) / mm << " mm";
    if (k > 1) {
      const double order = order_of(sheets[k - 2], sheets[k - 1], now);
      std::cout << ", order " << order;
      EXPECT_GE(order, 1.8) << cells[k];
    }
    std::cout << std::endl;
  }
}

}  // namespace
}  // namespace drape::simulate
