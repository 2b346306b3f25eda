// SPDX-License-Identifier: Apache-2.0
#include "simulate/cloth/cloth.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "simulate/cloth/test_grid.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

const GridSpec kGrid{7, 6, {0.06, 0.04}};

TEST(Cloth, ForceIsTheGradientOfTheEnergy) {
  Cloth cloth(kGrid, knotted_laws(), MassRule::area);
  Field x = crumpled(kGrid);
  const Field force = forces_of(cloth, x);
  double largest = 0;
  for (const double f : force) largest = std::max(largest, std::abs(f));
  // Central differences of order four: error about h^4 and rounding 1e-16 E / h.
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
    EXPECT_NEAR(force[k], -slope, 1e-7 * largest) << k;
  }
}

TEST(Cloth, InternalForcesKeepMomentumAndAngularMomentum) {
  Cloth cloth(kGrid, knotted_laws(), MassRule::area);
  const Field x = crumpled(kGrid);
  Field v(x.size());
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = std::sin(0.37 * static_cast<double>(i));
  for (const Field* velocity : {static_cast<const Field*>(nullptr), &std::as_const(v)}) {
    ClothLaws laws = knotted_laws();
    laws.stretch_damping_s = 1e-5;
    Cloth damped(kGrid, laws, MassRule::area);
    expect_balanced(x, forces_of(damped, x, velocity));
  }
}

TEST(Cloth, MassIsThatOfThePatchForBothRules) {
  for (const MassRule rule : {MassRule::area, MassRule::paper}) {
    const Cloth cloth(kGrid, knotted_laws(), rule);
    EXPECT_NEAR(cloth.total_mass_kg(), 0.138 * 0.06 * 0.04, 1e-15);
  }
  const Cloth area(kGrid, knotted_laws(), MassRule::area);
  EXPECT_NEAR(area.mass_kg()[0] * 4, area.mass_kg()[kGrid.index(3, 3)], 1e-18);
  const Cloth paper(kGrid, knotted_laws(), MassRule::paper);
  EXPECT_DOUBLE_EQ(paper.mass_kg()[0], paper.mass_kg()[kGrid.index(3, 3)]);
}

// Patch tests: a uniform deformation gives back the input curve, whatever the grid.

TEST(Patch, UniaxialStretchGivesTheTensileCurve) {
  const ClothLaws laws = knotted_laws();
  for (const double strain : {-0.01, 0.002, 0.008, 0.03}) {
    for (const GridSpec& grid : {GridSpec{4, 4, {0.06, 0.04}}, GridSpec{9, 5, {0.06, 0.04}}}) {
      Cloth cloth(grid, laws, MassRule::area);
      const auto pull = [&](bool along_warp) {
        const Field x = shaped(grid, [&](double u, double v) {
          return along_warp ? Vector3d((1 + strain) * u, v, 0) : Vector3d(u, (1 + strain) * v, 0);
        });
        const Field force = forces_of(cloth, x);
        double sum = 0;
        for (int k = 0; k < (along_warp ? grid.cols : grid.rows); ++k) {
          const int i = along_warp ? grid.index(0, k) : grid.index(k, 0);
          sum += force[(along_warp ? 0 : 1) * static_cast<std::size_t>(grid.count()) + i];
        }
        return sum / (along_warp ? 0.04 : 0.06);
      };
      EXPECT_NEAR(pull(true) / laws.tensile[0].value(strain), 1, 1e-12);
      EXPECT_NEAR(pull(false) / laws.tensile[1].value(strain), 1, 1e-12);
    }
  }
}

TEST(Patch, ShearWorkIsTheAreaUnderTheShearCurve) {
  const ClothLaws laws = knotted_laws();
  Cloth cloth(kGrid, laws, MassRule::area);
  for (const double angle : {0.02, -0.09, 0.2}) {
    const Field x = trellis(kGrid, angle);
    const double area = 0.06 * 0.04;
    EXPECT_NEAR(cloth.energies(x).shear_j / (area * laws.shear.energy(std::abs(angle))), 1, 1e-12);
    EXPECT_NEAR(cloth.energies(x).stretch_j, 0, 1e-15);
  }
}

TEST(Patch, RolledStripGivesTheMomentCurve) {
  // Rolled to a cylinder with chords of the rest length: curvature 2 sin(theta/2) / l.
  const ClothLaws laws = knotted_laws();
  const GridSpec grid{11, 4, {0.05, 0.02}};
  Cloth cloth(grid, laws, MassRule::area);
  for (const double curvature : {10.0, 45.0, 90.0}) {
    const double l = grid.warp_spacing_m();
    const double turn = 2 * std::asin(0.5 * curvature * l);
    const double radius = 0.5 * l / std::sin(0.5 * turn);
    const Field x = shaped(grid, [&](double u, double v) {
      const double angle = turn * u / l;
      return Vector3d(radius * std::sin(angle), v, radius * (1 - std::cos(angle)));
    });
    const double hinges = 9 * l * 0.02;  // area that the inner triples stand for
    EXPECT_NEAR(cloth.energies(x).bending_j / (hinges * laws.bending[0].energy(curvature)), 1,
                1e-12);
  }
}

TEST(Patch, CylinderAtFortyFiveDegreesGivesTheBiasStiffness) {
  // Cooper 1960: B(t) = Bwarp c^4 + Bweft s^4 + J c^2 s^2 with J = 4 B45 - Bwarp - Bweft.
  ClothLaws laws = knotted_laws();
  laws.bending[0] = {7.7e-6, {}};
  laws.bending[1] = {5.0e-6, {}};
  const double bias = 7.1e-6;
  laws.twist_n_m = 4 * bias - 7.7e-6 - 5.0e-6;
  const GridSpec grid{81, 81, {0.04, 0.04}};
  Cloth cloth(grid, laws, MassRule::area);
  const double curvature = 5;
  const Field x = shaped(grid, [&](double u, double v) {
    const double s = (u + v) / std::numbers::sqrt2;
    const double t = (u - v) / std::numbers::sqrt2;
    return Vector3d(std::sin(curvature * s) / curvature, t,
                    (1 - std::cos(curvature * s)) / curvature);
  });
  const double expected = 0.5 * bias * curvature * curvature * 0.04 * 0.04;
  const InternalEnergies found = cloth.energies(x);
  // Triples reach from border to border less half a spacing: 1/80 of the area is missing.
  EXPECT_NEAR(found.bending_j + found.twist_j, expected, 0.02 * expected);
}

TEST(Cloth, StiffnessBoundIsAboveTheHighestFrequency) {
  const GridSpec grid{9, 8, {0.08, 0.07}};
  Cloth cloth(grid, knotted_laws(), MassRule::area);
  const Field x = shaped(grid, [](double u, double v) {
    return Vector3d(1.005 * u + 0.1 * v, 1.003 * v, 0.002 * std::sin(60 * u));
  });
  const double omega_squared = highest_frequency_squared(cloth, x);
  const double bound = cloth.stiffness_bound_per_s2(cloth.strains(x));
  EXPECT_GT(bound, 0.999 * omega_squared);
  EXPECT_LT(bound, 1.5 * omega_squared);  // and not wastefully so
}

}  // namespace
}  // namespace drape::simulate
