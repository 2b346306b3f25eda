// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "simulate/validation/test_sheets.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

/// A square sheet clamped along one edge in a sideways and downward gravity: stretch, shear,
/// bending along both threads and twist all work. Its free corner, in units of the free length.
Vector3d corner(int cells) {
  const double length = 0.06;
  const double h = length / (cells + 0.5);  // the clamp line: half a cell before the second row
  const GridSpec grid{cells + 2, cells + 1, {h * (cells + 1), length}};
  ClothLaws laws = linear_laws(0.138, 300, 20, 7.7e-6);
  laws.bending[1].slope = 5e-6;
  laws.twist_n_m = 1.1e-5;
  Cloth cloth(grid, laws, MassRule::area);
  Field x = shaped(grid, [h](double u, double v) { return Vector3d(u - 0.5 * h, v, 0); });
  Equilibrium balance(cloth, weight(cloth, {0, 0.5 * kGravity, -0.8 * kGravity}),
                      held_rows(grid, {0, 1}, false));
  const Equilibrium::Outcome outcome = balance.find(x, 0.01);
  return outcome.found ? Vector3d(at(x, grid.count() - 1) / length) : Vector3d::Zero();
}

/// Tip of a heavy strip at Gamma 10, the same study on a line.
double strip_tip(int cells) {
  const double length = 0.1;
  const double h = length / (cells + 0.5);
  const GridSpec grid{cells + 2, 2, {h * (cells + 1), h}};
  const double bending = 10 * 7.7e-6;
  const double density = 10 * bending / (kGravity * std::pow(length, 3));
  Cloth cloth(grid, linear_laws(density, 1e5 * density * kGravity * length, 1, bending),
              MassRule::area);
  Field x = shaped(grid, [h](double u, double v) { return Vector3d(u - 0.5 * h, v, 0); });
  Equilibrium balance(cloth, weight(cloth, {0, 0, -kGravity}), held_rows(grid, {0, 1}));
  (void)balance.find(x, 0.5 * h);
  return at(x, grid.count() - 1).z() / length;
}

TEST(Order, OfAStripsTipIsTwo) {
  const double tips[3] = {strip_tip(49), strip_tip(99), strip_tip(199)};
  const double ratio = std::log((99.5 / 49.5) * (199.5 / 99.5)) / 2;
  expect_at_least("self-convergence order of a strip's tip, Gamma 10",
                  std::log(std::abs((tips[0] - tips[1]) / (tips[1] - tips[2]))) / ratio, 1.8);
}

TEST(Order, OfABentAndTwistedSheetIsTwo) {
  const Vector3d corners[3] = {corner(10), corner(20), corner(40)};
  expect_at_least("self-convergence order of a bent and twisted sheet",
                  std::log((corners[0] - corners[1]).norm() / (corners[1] - corners[2]).norm()) /
                      (0.5 * std::log(40.5 / 10.5)),
                  1.8);
}

}  // namespace
}  // namespace drape::simulate
