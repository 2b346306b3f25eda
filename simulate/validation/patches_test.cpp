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

ClothLaws knotted_laws() {
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.138;
  laws.tensile[0] = {4000, {{0.004, 2500}, {0.01, 6000}}};
  laws.tensile[1] = {2000, {{0.006, 900}}};
  laws.shear = {34, {{0.05, -10}, {0.12, 8}}};
  laws.bending[0] = {7.7e-6, {{20, -2e-6}, {60, -1e-6}}};
  laws.bending[1] = {5.0e-6, {{30, -1e-6}}};
  laws.twist_n_m = 1.1e-5;
  return laws;
}

const GridSpec kGrid{7, 6, {0.06, 0.04}};

/// Force per width over the cut between the first two rows or columns of a stretched sheet.
double pull(Cloth& cloth, int direction, double strain) {
  const GridSpec& grid = cloth.grid();
  const Field x = shaped(grid, [&](double u, double v) {
    return direction == 0 ? Vector3d((1 + strain) * u, v, 0) : Vector3d(u, (1 + strain) * v, 0);
  });
  Field force(x.size(), 0.0);
  cloth.add_forces(x, nullptr, force);
  double sum = 0;
  for (int k = 0; k < (direction == 0 ? grid.cols : grid.rows); ++k) {
    const int i = direction == 0 ? grid.index(0, k) : grid.index(k, 0);
    sum += force[static_cast<std::size_t>(direction) * grid.count() + i];
  }
  return sum / grid.patch_m[1 - direction];
}

TEST(Patch, GivesBackItsCurves) {
  const ClothLaws laws = knotted_laws();
  Cloth cloth(kGrid, laws, MassRule::area);
  double worst[2] = {0, 0};
  for (int d = 0; d < 2; ++d) {
    for (const double strain : {-0.01, 0.002, 0.008, 0.03}) {
      const double expected = laws.tensile[d].value(strain);
      worst[d] = std::max(worst[d], std::abs(pull(cloth, d, strain) / expected - 1));
    }
  }
  expect_at_most("uniaxial patch gives back the tensile curves", std::max(worst[0], worst[1]),
                 1e-12);
  double shear = 0;
  for (const double angle : {0.02, -0.09, 0.2}) {
    const Field x = shaped(kGrid, [&](double u, double v) {
      return Vector3d(u * std::cos(angle / 2) + v * std::sin(angle / 2),
                      u * std::sin(angle / 2) + v * std::cos(angle / 2), 0);
    });
    const double expected = 0.06 * 0.04 * laws.shear.energy(std::abs(angle));
    shear = std::max(shear, std::abs(cloth.energies(x).shear_j / expected - 1));
  }
  expect_at_most("trellis patch gives back the work under the shear curve", shear, 1e-12);
  // Rolled up with chords of the rest length: curvature 2 sin(turn / 2) / spacing.
  double moment = 0;
  const double h = kGrid.warp_spacing_m();
  for (const double curvature : {10.0, 45.0, 90.0}) {
    const double turn = 2 * std::asin(0.5 * curvature * h);
    const double radius = 0.5 * h / std::sin(0.5 * turn);
    const Field x = shaped(kGrid, [&](double u, double v) {
      return Vector3d(radius * std::sin(turn * u / h), v, radius * (1 - std::cos(turn * u / h)));
    });
    const double expected = 5 * h * 0.04 * laws.bending[0].energy(curvature);
    moment = std::max(moment, std::abs(cloth.energies(x).bending_j / expected - 1));
  }
  expect_at_most("rolled strip gives back the work under the moment curve", moment, 1e-12);
}

/// A hinged frame of edge a pulled at two corners: F = a f(g) / sin(45 deg - g / 2).
TEST(Patch, OfAPictureFrameNeedsTheFormsForce) {
  ClothLaws laws = knotted_laws();
  laws.shear = {34, {{0.05, -10}}};
  const double edge = 0.05;
  const GridSpec grid{11, 11, {edge, edge}};
  Cloth cloth(grid, laws, MassRule::area);
  for (const double g : {0.02, 0.2, 0.5}) {
    const Field x = shaped(grid, [g](double u, double v) {
      return Vector3d(u * std::cos(g / 2) + v * std::sin(g / 2),
                      u * std::sin(g / 2) + v * std::cos(g / 2), 0);
    });
    Field force(x.size(), 0.0);
    cloth.add_forces(x, nullptr, force);
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

TEST(Patch, HasTheGradientOfItsEnergyForForces) {
  Cloth cloth(kGrid, knotted_laws(), MassRule::area);
  Field x = shaped(kGrid, [](double u, double v) {
    return Vector3d(1.012 * u + 0.05 * v + 2e-4 * std::sin(900 * u + 300 * v),
                    0.99 * v + 0.002 * std::sin(60 * u), 0.006 * std::sin(70 * u + 40 * v));
  });
  Field force(x.size(), 0.0);
  cloth.add_forces(x, nullptr, force);
  double largest = 0;
  double worst = 0;
  const double h = 1e-7;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double kept = x[k];
    const auto energy = [&](double shift) {
      x[k] = kept + shift;
      const double e = cloth.energies(x).sum_j();
      x[k] = kept;
      return e;
    };
    const double slope =
        (8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h);
    worst = std::max(worst, std::abs(force[k] + slope));
    largest = std::max(largest, std::abs(force[k]));
  }
  expect_at_most("forces against differences of the energy", worst / largest, 1e-7);
  Vector3d sum = Vector3d::Zero();
  Vector3d moment = Vector3d::Zero();
  double scale = 0;
  for (int i = 0; i < kGrid.count(); ++i) {
    sum += at(force, i);
    moment += at(x, i).cross(at(force, i));
    scale += at(force, i).norm();
  }
  expect_at_most("sum of internal forces, over the sum of their sizes", sum.norm() / scale, 1e-13);
  expect_at_most("moment of internal forces, over 6 cm times that sum",
                 moment.norm() / (0.06 * scale), 1e-13);
  Equilibrium balance(cloth, Field(x.size(), 0.0), std::vector<bool>(x.size(), false));
  (void)balance.tangent(x);
  expect_at_most("asymmetry of the tangent, over its largest entry", balance.asymmetry(), 1e-7);
}

}  // namespace
}  // namespace drape::simulate
