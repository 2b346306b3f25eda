// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "simulate/validation/test_sheets.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

/// A hinged frame of edge a pulled at two corners: F = a f(g) / sin(45 deg - g / 2).
TEST(Patch, OfAPictureFrameNeedsTheFormsForce) {
  ClothLaws laws = knotted_laws();
  laws.shear = {34, {{0.05, -10}}};
  const double edge = 0.05;
  const GridSpec grid{11, 11, {edge, edge}};
  Cloth cloth(grid, laws, MassRule::area);
  for (const double g : {0.02, 0.2, 0.5}) {
    const Field x = trellis(grid, g), force = forces_of(cloth, x);
    // The frame's arms carry the particle forces to the corners: virtual work of the shear angle.
    double work = 0;
    for (int i = 0; i < grid.count(); ++i) {
      const int row = i / 11, col = i % 11;
      const double u = row * grid.warp_spacing_m();
      const double v = col * grid.weft_spacing_m();
      const Vector3d per_angle(0.5 * (-u * std::sin(g / 2) + v * std::cos(g / 2)),
                               0.5 * (u * std::cos(g / 2) - v * std::sin(g / 2)), 0);
      work -= at(force, i).dot(per_angle);
    }
    const double diagonal_per_angle = edge * std::sin(std::numbers::pi / 4 - g / 2);
    const double expected = edge * laws.shear.value(g) / std::sin(std::numbers::pi / 4 - g / 2);
    expect_relative(fmt::format("picture frame force (N) at shear {:g} rad", g), expected,
                    work / diagonal_per_angle, 1e-3);
  }
}

TEST(Patch, OfAHangingStripStretchesAsItsWeight) {
  const double length = 0.2;
  const double density = 0.138;
  const double stiffness = 400;
  const GridSpec grid{41, 3, {length, 0.03}};
  Cloth cloth(grid, linear_laws(density, stiffness, 30, 1e-13), MassRule::area);
  Field x = shaped(grid, [](double u, double v) { return Vector3d(u, v, 0); });
  Equilibrium balance(cloth, weight(cloth, {kGravity, 0, 0}), held_rows(grid, {0}));
  (void)balance.find(x, grid.warp_spacing_m());
  const double drop = at(x, grid.index(40, 1)).x() - length;
  expect_relative("hanging strip: drop of its end (m)",
                  density * kGravity * length * length / (2 * stiffness), drop, 1e-6);
  double worst = 0;  // tension falls linearly from the clamp to the end
  for (int r = 0; r + 1 < grid.rows; ++r) {
    const double h = grid.warp_spacing_m();
    const double strain = (at(x, grid.index(r + 1, 1)).x() - at(x, grid.index(r, 1)).x()) / h - 1;
    const double expected = density * kGravity * (length - (r + 0.5) * h);
    worst = std::max(worst, std::abs(stiffness * strain / expected - 1));
  }
  expect_at_most("hanging strip: tension along it", worst, 1e-6);
}

TEST(Patch, HasASymmetricTangent) {
  const GridSpec grid{7, 6, {0.06, 0.04}};
  Cloth cloth(grid, knotted_laws(), MassRule::area);
  const Field x = crumpled(grid);
  Equilibrium balance(cloth, Field(x.size(), 0.0), std::vector<bool>(x.size(), false));
  (void)balance.tangent(x);
  expect_at_most("asymmetry of the tangent, over its largest entry", balance.asymmetry(), 1e-7);
}

}  // namespace
}  // namespace drape::simulate
