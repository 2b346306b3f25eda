// SPDX-License-Identifier: Apache-2.0
#include "simulate/dynamics/motion.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "core/files/csv.hpp"
#include "simulate/cloth/test_grid.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kG = 9.80665;

/// Lays the grid flat: warp along x, weft along y, at height z.
void lay_flat(const GridSpec& grid, double z, Field& x) {
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      put_at(x, grid.index(r, c), {r * grid.warp_spacing_m(), c * grid.weft_spacing_m(), z});
    }
  }
}

Hold particle(int i) {
  return {{i, i, i, i}, {1, 0, 0, 0}};
}

/// Steps with kinetic damping until the residual is below the tolerance.
bool settle(Motion& motion, double tolerance, long limit) {
  double before = 0;
  bool rising = false;
  for (long k = 0; k < limit; ++k) {
    motion.step(motion.stable_step_s(0.9));
    const double now = motion.kinetic_energy_j();
    if (now < before && rising) {
      motion.stop();
      before = 0;
      rising = false;
    } else {
      rising = now >= before;
      before = now;
    }
    if (k % 50 == 0 && motion.residual() < tolerance) return true;
  }
  return false;
}

TEST(Motion, HangingStripStretchesByItsWeight) {
  // Tip drop rho g L^2 / (2 K); the lumped chain of area masses gives it exactly.
  const double length = 0.2, density = 0.138, stiffness = 400;
  const GridSpec grid{11, 3, {length, 0.03}};
  ClothLaws laws = linear_laws(density, stiffness, 30, 1e-6);
  laws.stretch_damping_s = 1e-4;
  Cloth cloth(grid, laws, MassRule::area);
  const Surroundings nothing;
  Motion motion(cloth, nothing, {{kG, 0, 0}, 4, 0, 0, false});
  lay_flat(grid, 0, motion.position);
  motion.hold({particle(0), particle(1), particle(2)});
  ASSERT_TRUE(settle(motion, 1e-7, 200000));
  const double drop = at(motion.position, grid.index(10, 1)).x() - length;
  const double expected = density * kG * length * length / (2 * stiffness);
  EXPECT_NEAR(drop, expected, 1e-6 * expected);
}

TEST(Motion, CantileverFollowsTheMasterCurve) {
  const std::filesystem::path folder = drape::test::test_data("physics");
  const Csv curve =
      read_csv(folder / "cantilever_master_curve.csv",
               {"Gamma", "W_over_L", "H_over_L", "H_over_W", "theta_tip_rad", "M_clamp_L_over_B"});
  const auto master = [&curve](double gamma) {
    const std::vector<double>& g = curve.columns[0];
    std::size_t i = 1;
    while (g[i] < gamma) ++i;
    const double t = (gamma - g[i - 1]) / (g[i] - g[i - 1]);
    return curve.columns[3][i - 1] + t * (curve.columns[3][i] - curve.columns[3][i - 1]);
  };
  // Clamp: two columns held, the clamp line half a cell before the second one's hinge. Putting it
  // at the second column instead would be 20 % off at this grid.
  const double density = 0.138, bending = 7.7e-6;
  for (const double gamma : {1.0, 10.0}) {
    const double length = std::cbrt(gamma * bending / (density * kG));
    const int rows = 22;
    const double spacing = length / (rows - 1.5);
    const GridSpec grid{rows, 3, {spacing * (rows - 1), 0.01}};
    ClothLaws laws = linear_laws(density, 3000, 30, bending);
    laws.stretch_damping_s = 2e-6;
    Cloth cloth(grid, laws, MassRule::area);
    const Surroundings nothing;
    Motion motion(cloth, nothing, {{0, 0, -kG}, 4, 0, 0, false});
    lay_flat(grid, 0, motion.position);
    std::vector<Hold> clamp;
    clamp.reserve(2 * grid.cols);
    for (int i = 0; i < 2 * grid.cols; ++i) clamp.push_back(particle(i));
    motion.hold(clamp);
    ASSERT_TRUE(settle(motion, 1e-3, 2000000));
    const Vector3d tip = at(motion.position, grid.index(rows - 1, 1));
    const double ratio = -tip.z() / (tip.x() - 0.5 * spacing);
    EXPECT_NEAR(ratio, master(gamma), 0.01 * master(gamma)) << "Gamma " << gamma;
  }
}

TEST(Motion, CatenaryWithoutBending) {
  // Chord 0.775 of the length: sag 0.280388 of the length (data/physics, exact).
  const double length = 0.2;
  const int rows = 41;
  const GridSpec grid{rows, 2, {length, 0.004}};
  ClothLaws laws = linear_laws(0.3, 6000, 30, 1e-13);
  laws.shear = {0.3, {}};
  laws.stretch_damping_s = 2e-6;
  Cloth cloth(grid, laws, MassRule::area);
  const Surroundings nothing;
  Motion motion(cloth, nothing, {{0, 0, -kG}, 4, 0, 0, false});
  for (int r = 0; r < rows; ++r) {
    const double t = 2.0 * r / (rows - 1) - 1;
    for (int c = 0; c < 2; ++c) {
      put_at(motion.position, grid.index(r, c),
             {0.5 * 0.775 * length * t, 0.004 * c, -0.28 * length * (1 - t * t)});
    }
  }
  motion.hold({particle(0), particle(1), particle(grid.index(rows - 1, 0)),
               particle(grid.index(rows - 1, 1))});
  ASSERT_TRUE(settle(motion, 1e-2, 400000));
  const double sag = -at(motion.position, grid.index(rows / 2, 0)).z();
  // The polygon of 40 links lies within 1e-3 of the curve.
  EXPECT_NEAR(sag / length, 0.280388, 1e-3);
}

TEST(Motion, EnergyIsKeptWithoutDampingAndFallsWithIt) {
  const GridSpec grid{8, 8, {0.1, 0.1}};
  for (const double damping : {0.0, 5.0}) {
    Cloth cloth(grid, linear_laws(0.138, 2000, 30, 7.7e-6), MassRule::area);
    const Surroundings nothing;
    Motion motion(cloth, nothing, {{0, 0, -kG}, damping, 0, 0, false});
    lay_flat(grid, 0, motion.position);
    motion.hold({particle(0), particle(7)});
    const auto energy = [&] {
      return motion.kinetic_energy_j() + motion.gravity_energy_j() +
             cloth.energies(motion.position).sum_j();
    };
    const double start = energy();
    const double scale = cloth.total_mass_kg() * kG * 0.1;
    double before = start;
    for (int k = 0; k < 4000; ++k) {
      motion.step(2e-5);
      const double now = energy();
      if (damping > 0) {
        ASSERT_LT(now, before + 1e-9 * scale);
      }
      before = now;
    }
    if (damping == 0) {
      EXPECT_NEAR(before, start, 1e-5 * scale);
    } else {
      EXPECT_NEAR(start - before, motion.viscous_loss_j(), 1e-3 * (start - before));
    }
  }
}

TEST(Motion, FreeFallKeepsMomentumOfTheWholeSheet) {
  const GridSpec grid{6, 5, {0.1, 0.1}};
  Cloth cloth(grid, linear_laws(0.138, 2000, 30, 7.7e-6), MassRule::area);
  const Surroundings nothing;
  Motion motion(cloth, nothing, {{0, 0, -kG}, 0, 0, 0, false});
  lay_flat(grid, 0, motion.position);
  for (std::size_t i = 0; i < motion.velocity.size(); ++i) {
    motion.velocity[i] = 0.1 * std::sin(static_cast<double>(i));
  }
  const auto momentum = [&] {
    Vector3d sum = Vector3d::Zero();
    for (int i = 0; i < grid.count(); ++i) sum += cloth.mass_kg()[i] * at(motion.velocity, i);
    return sum;
  };
  const Vector3d start = momentum();
  double time = 0;
  for (int k = 0; k < 1000; ++k) time += motion.step(3e-5);
  const Vector3d expected = start + cloth.total_mass_kg() * time * Vector3d(0, 0, -kG);
  EXPECT_LT((momentum() - expected).norm(), 1e-10 * expected.norm());
}

/// A small stiff sheet on the tilted top of the table: gravity is tilted instead of the table.
struct Incline {
  GridSpec grid{3, 3, {0.02, 0.02}};
  Cloth cloth{grid, linear_laws(0.2, 2000, 30, 1e-4), MassRule::area};
  Surroundings table;
  explicit Incline(double) { table.add(Table{0}); }
};

TEST(Friction, BlockOnAnInclineSticksBelowTheAngleOfFriction) {
  const double mu = 0.4;
  Incline block(0);
  const double slope = 0.99 * std::atan(mu);
  Motion motion(block.cloth, block.table,
                {kG * Vector3d(std::sin(slope), 0, -std::cos(slope)), 0, 0, mu, true});
  lay_flat(block.grid, 1e-9, motion.position);
  for (int k = 0; k < 5000; ++k) motion.step(5e-5);
  EXPECT_NEAR(at(motion.position, 4).x(), 0.01, 1e-6);
  EXPECT_LT(motion.residual(), 1e-9);
}

TEST(Friction, BlockOnAnInclineSlidesAsCoulombSays) {
  const double mu = 0.4;
  Incline block(0);
  const double slope = 0.7;
  Motion motion(block.cloth, block.table,
                {kG * Vector3d(std::sin(slope), 0, -std::cos(slope)), 0, 0, mu, true});
  lay_flat(block.grid, 1e-9, motion.position);
  double time = 0;
  for (int k = 0; k < 4000; ++k) time += motion.step(5e-5);
  const double displacement = 0.5 * kG * (std::sin(slope) - mu * std::cos(slope)) * time * time;
  EXPECT_NEAR(at(motion.position, 4).x() - 0.01, displacement, 0.01 * displacement);
  EXPECT_NEAR(motion.residual(), std::sin(slope) - mu * std::cos(slope), 2.0);
  EXPECT_GT(motion.residual(), 0.1);
}

TEST(Friction, SlidingBlockStopsAfterItsBrakingDistance) {
  const double mu = 0.4, speed = 0.3;
  Incline block(0);
  Motion motion(block.cloth, block.table, {{0, 0, -kG}, 0, 0, mu, true});
  lay_flat(block.grid, 1e-9, motion.position);
  for (int i = 0; i < 9; ++i) motion.velocity[i] = speed;
  for (int k = 0; k < 4000; ++k) motion.step(5e-5);
  const double displacement = speed * speed / (2 * mu * kG);
  EXPECT_NEAR(at(motion.position, 4).x() - 0.01, displacement, 0.01 * displacement);
  EXPECT_EQ(motion.kinetic_energy_j(), 0);
}

TEST(Contact, SheetLandsOnTheTableAndStaysOnIt) {
  const GridSpec grid{5, 5, {0.05, 0.05}};
  Cloth cloth(grid, linear_laws(0.138, 2000, 30, 7.7e-6), MassRule::area);
  Surroundings table;
  table.add(Table{0.01});
  Motion motion(cloth, table, {{0, 0, -kG}, 0, 0, 0.3, true});
  lay_flat(grid, 0.012, motion.position);
  for (int i = 0; i < grid.count(); ++i) put_at(motion.velocity, i, {0, 0, -1});
  for (int k = 0; k < 1000; ++k) motion.step(1e-4);
  EXPECT_EQ(motion.contacts(), grid.count());
  EXPECT_GT(motion.backtracked_steps(), 0);  // the step was cut at the impact
  for (int i = 0; i < grid.count(); ++i) EXPECT_NEAR(at(motion.position, i).z(), 0.01, 1e-9);
  EXPECT_LT(motion.residual(), 1e-6);
}

TEST(Contact, LiftedParticlesAreReleased) {
  const GridSpec grid{3, 3, {0.02, 0.02}};
  Cloth cloth(grid, linear_laws(0.2, 2000, 30, 1e-6), MassRule::area);
  Surroundings table;
  table.add(Table{0});
  Motion motion(cloth, table, {{0, 0, kG}, 0, 0, 0.3, true});  // gravity points up
  lay_flat(grid, 1e-12, motion.position);
  for (int k = 0; k < 1000; ++k) motion.step(2e-5);
  EXPECT_EQ(motion.contacts(), 0);
  EXPECT_NEAR(at(motion.position, 4).z(), 0.5 * kG * 0.02 * 0.02, 1e-9);
}

TEST(Contact, DistancesToShapesAreExact) {
  Surroundings shapes;
  shapes.add(Sphere{{0, 0, 0}, 0.045});
  shapes.add(Box{{}, {0.1, 0.1, 0.1}, 0.01});
  EXPECT_NEAR(shapes.gap_m(0, {0, 0, 0.05}), 0.005, 1e-15);
  EXPECT_NEAR(shapes.gap_m(1, {0, 0, 0.06}), 0.01, 1e-15);
  EXPECT_NEAR(shapes.gap_m(1, {0.05, 0.05, 0}), 0.01 * (std::numbers::sqrt2 - 1), 1e-15);
  EXPECT_NEAR(shapes.gap_m(1, {0, 0, 0.04}), -0.01, 1e-15);
  const double d = 1 / std::numbers::sqrt2;
  EXPECT_LT((shapes.normal(1, {0.06, -0.06, 0}) - Vector3d(d, -d, 0)).norm(), 1e-12);
  EXPECT_NEAR(shapes.top_z_m(), 0.05, 1e-15);
}

TEST(Contact, BetweenParticlesKeepsACoarseSheetOffABoxEdge) {
  const GridSpec grid{4, 4, {0.12, 0.12}};
  Surroundings box;
  box.add(Box{{}, {0.08, 0.3, 0.08}, 0.002});
  double depth[2] = {0, 0};
  for (const bool between : {false, true}) {
    ClothLaws laws = linear_laws(0.138, 2000, 30, 7.7e-6);
    laws.stretch_damping_s = 1e-5;
    Cloth cloth(grid, laws, MassRule::area);
    Motion motion(cloth, box, {{0, 0, -kG}, 4, 0, 0.5, between});
    lay_flat(grid, 0.041, motion.position);
    for (int i = 0; i < grid.count(); ++i) motion.position[i] -= 0.01;  // overhangs at one side
    ASSERT_TRUE(settle(motion, 1e-2, 100000));
    for (int r = 0; r + 1 < grid.rows; ++r) {
      for (int k = 0; k <= 100; ++k) {
        const Vector3d p = at(motion.position, grid.index(r, 1)) * (1 - 0.01 * k) +
                           at(motion.position, grid.index(r + 1, 1)) * 0.01 * k;
        depth[between] = std::max(depth[between], -box.gap_m(0, p));
      }
    }
  }
  EXPECT_GT(depth[0], 1e-3);
  EXPECT_LT(depth[1], 0.1e-3);
}

TEST(Step, JustAboveTheLimitBlowsUpAndBelowItDoesNot) {
  const GridSpec grid{21, 21, {0.2, 0.2}};
  const double limit = std::numbers::sqrt2 * grid.warp_spacing_m() * std::sqrt(0.138 / 2000);
  for (const double fraction : {0.98, 1.06}) {
    ClothLaws laws = linear_laws(0.138, 2000, 30, 1e-9);
    laws.shear = {1e-6, {}};
    Cloth cloth(grid, laws, MassRule::area);
    const Surroundings nothing;
    Motion motion(cloth, nothing, {{0, 0, 0}, 0, 0, 0, false});
    lay_flat(grid, 0, motion.position);
    for (int i = 0; i < grid.count(); ++i) motion.position[i] += (i / 21 % 2 == 0 ? 1e-9 : -1e-9);
    const double start = cloth.energies(motion.position).sum_j();
    double end = start;
    // A motion that blows up is watched only until it has: its numbers overflow before long.
    for (int k = 0; k < 200 && !(end > 100 * start); ++k) {
      motion.step(fraction * limit);
      end = motion.kinetic_energy_j() + cloth.energies(motion.position).sum_j();
    }
    if (fraction < 1) {
      EXPECT_LE(end, 1.0001 * start);
      EXPECT_NEAR(motion.stable_step_s(1.0), limit, 0.02 * limit);
    } else {
      EXPECT_GT(end, 100 * start);
    }
  }
}

}  // namespace
}  // namespace drape::simulate
