// SPDX-License-Identifier: Apache-2.0
// The paper's model (section 4) against closed forms.
#include "simulate/paper/paper.hpp"

#include <gtest/gtest.h>

#include "core/files/files.hpp"
#include "simulate/fabric/test_laws.hpp"
#include "simulate/paper/paper_motion.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

constexpr double kG = 9.80665;
const ParticleGrid kSquare{7, 5, {0.06, 0.04}}, kOblong{7, 6, {0.06, 0.04}};

/// Positions from a map of material coordinates (m) to space.
template <class Map>
Particles shaped(const ParticleGrid& grid, const Map& map) {
  Particles x(3, grid.count());
  for (int i = 0; i < grid.count(); ++i) {
    const Eigen::Vector2d m = grid.material_m(i);
    x.col(i) = map(m.x(), m.y());
  }
  return x;
}
Particles flat(const ParticleGrid& grid, double z = 0) {
  return shaped(grid, [&](double u, double v) { return Vector3d(u, v, z); });
}
/// Both thread families keep their length and rotate by half the angle.
Particles trellis(const ParticleGrid& grid, double angle) {
  const double c = std::cos(angle / 2), s = std::sin(angle / 2);
  return shaped(grid,
                [=](double u, double v) { return Vector3d(u * c + v * s, u * s + v * c, 0); });
}

Particles forces_of(const PaperCloth& cloth, const Particles& x,
                    const Particles* velocity = nullptr) {
  Particles force = Particles::Zero(3, x.cols());
  (void)cloth.add_forces(x, velocity, force);
  return force;
}

/// Force per width on an inner particle of the first row or column, stretched by `strain` at
/// constant width.
double inner_pull(const ParticleGrid& grid, const ClothLaws& laws, double strain, bool along_warp) {
  const Particles x = shaped(grid, [&](double u, double v) {
    return along_warp ? Vector3d((1 + strain) * u, v, 0) : Vector3d(u, (1 + strain) * v, 0);
  });
  const Particles force = forces_of(PaperCloth(grid, laws), x);
  return along_warp ? force(0, 2) / grid.spacing_m().y()
                    : force(1, 2 * grid.cols) / grid.spacing_m().x();
}

TEST(PaperCloth, UniaxialStretchOfAnInnerLineGivesKst) {
  // The diagonals carry what K'st lacks to first order in the strain: with s the angle of the
  // diagonals, their contribution differs from K_diag strain by less than 3 strain of itself.
  const ClothLaws laws = knotted_laws();
  for (const ParticleGrid& grid : {kSquare, kOblong}) {
    for (const double strain : {-0.01, 1e-6, 0.002, 0.008, 0.03}) {
      const double bound = 3 * strain * strain * laws.shear.slope * 2 + 1e-9;
      EXPECT_NEAR(inner_pull(grid, laws, strain, true), laws.tensile[0].value(strain), bound);
      EXPECT_NEAR(inner_pull(grid, laws, strain, false), laws.tensile[1].value(strain), bound);
    }
  }
  // f - K strain + 2 K (1 - d0 / d) (1 + strain), K the limit slope at no shear, square cells.
  for (const double strain : {-0.01, 0.002, 0.03}) {
    const double stretched = 1 + strain;
    const double diagonals =
        2 * laws.shear.slope * stretched * (1 - std::sqrt(2 / (1 + stretched * stretched)));
    EXPECT_NEAR(inner_pull(kSquare, laws, strain, true),
                laws.tensile[0].value(strain) - laws.shear.slope * strain + diagonals, 1e-9);
  }
}

TEST(PaperCloth, PureShearFollowsTheShearCurve) {
  // Exact agreement with the curve needs K = f / (sqrt(1 + s) - sqrt(1 - s)), s = sin a; the
  // paper's f / s exceeds that by s^2 / 8 and higher terms.
  const ParticleGrid grid{3, 3, {0.02, 0.02}};
  const ClothLaws laws = knotted_laws();
  const PaperCloth cloth(grid, laws);
  for (const double angle : {1e-4, 0.02, 8 * units::deg, 0.3}) {
    const Particles slope = (trellis(grid, angle + 1e-6) - trellis(grid, angle - 1e-6)) / 2e-6;
    const double shear_force =
        -forces_of(cloth, trellis(grid, angle)).cwiseProduct(slope).sum() / grid.patch_m.prod();
    const double s = std::sin(angle);
    const double ratio = (std::sqrt(1 + s) - std::sqrt(1 - s)) / s;
    EXPECT_NEAR(shear_force, laws.shear.value(angle) * ratio, 1e-7 * shear_force) << angle;
  }
}

TEST(PaperCloth, ARolledStripBendsByTheMomentCurve) {
  // Rolled to a cylinder with chords of the rest length: curvature 2 sin(theta / 2) / l.
  const ClothLaws laws = knotted_laws();
  const ParticleGrid grid{11, 4, {0.05, 0.02}};
  const double l = grid.spacing_m().x();
  for (const double curvature : {10.0, 45.0, 90.0}) {
    const double turn = 2 * std::asin(0.5 * curvature * l);
    const double radius = 0.5 * l / std::sin(0.5 * turn);
    const Particles x = shaped(grid, [&](double u, double v) {
      const double angle = turn * u / l;
      return Vector3d(radius * std::sin(angle), v, radius * (1 - std::cos(angle)));
    });
    // Border lines represent as much cloth as inner ones.
    const double area = 9 * l * 4 * grid.spacing_m().y();
    EXPECT_NEAR(
        PaperCloth(grid, laws).energies(x).bending_j / (area * laws.bending[0].energy(curvature)),
        1, 1e-12);
  }
}

TEST(PaperCloth, EveryParticleHasTheSameMass) {
  EXPECT_DOUBLE_EQ(PaperCloth(kOblong, knotted_laws()).particle_kg(),
                   0.138 * 0.06 * 0.04 / kOblong.count());
}

TEST(PaperCloth, ForcesKeepMomentumAndAngularMomentum) {
  const PaperCloth cloth(kOblong, knotted_laws(), 1e-5);
  const Particles x = shaped(kOblong, [](double u, double v) {
    return Vector3d(1.012 * u + 0.05 * v + 2e-4 * std::sin(900 * u + 300 * v),
                    0.99 * v + 0.002 * std::sin(60 * u), 0.006 * std::sin(70 * u + 40 * v));
  });
  Particles v(3, kOblong.count());
  for (Eigen::Index i = 0; i < v.size(); ++i) v(i) = std::sin(0.37 * static_cast<double>(i));
  for (const Particles* velocity : {static_cast<const Particles*>(nullptr), &std::as_const(v)}) {
    const Particles force = forces_of(cloth, x, velocity);
    Vector3d moment = Vector3d::Zero();
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      moment += Vector3d(x.col(i)).cross(Vector3d(force.col(i)));
    const double scale = force.colwise().norm().sum();
    EXPECT_LT(force.rowwise().sum().norm(), 1e-13 * scale);
    EXPECT_LT(moment.norm(), 1e-13 * scale * 0.06);
  }
}

TEST(PaperCloth, AFlatSheetHasNoForce) {
  const PaperCloth cloth(kOblong, knotted_laws());
  EXPECT_LT(forces_of(cloth, flat(kOblong)).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_EQ(cloth.clamped_springs(flat(kOblong)), 0);
}

TEST(PaperCloth, SpringsBelowKdiagAreClampedAndCounted) {
  ClothLaws laws = knotted_laws();
  laws.tensile[1] = {20, {}};  // below the shear slope of 34
  EXPECT_EQ(PaperCloth(kSquare, laws).clamped_springs(flat(kSquare)), 7 * 4);
  const double strain = 1e-5;  // K'st is 0: only the diagonals pull, with K_diag
  EXPECT_NEAR(inner_pull(kSquare, laws, strain, false), 34 * strain, 1e-4 * 34 * strain);
}

/// Square of the highest frequency (1/s) about a state, by power iteration with differences of
/// forces.
double highest_frequency_squared(const PaperCloth& cloth, const Particles& x) {
  constexpr double kPlateStep = 1e-9;
  Particles mode(3, x.cols());
  for (Eigen::Index i = 0; i < mode.size(); ++i)
    mode(i) = std::sin(1.7 * static_cast<double>(i * i));
  double omega_squared = 0;
  for (int round = 0; round < 300; ++round) {
    mode /= mode.norm();
    const Particles next =
        (forces_of(cloth, x - kPlateStep * mode) - forces_of(cloth, x + kPlateStep * mode)) /
        (2 * kPlateStep * cloth.particle_kg());
    omega_squared = next.cwiseProduct(mode).sum();
    mode = next;
  }
  return omega_squared;
}

TEST(PaperCloth, StiffnessBoundIsAboveTheHighestFrequency) {
  const ParticleGrid grid{9, 8, {0.08, 0.07}};
  for (const double shear : {0.0, 0.1, 0.6}) {
    ClothLaws laws = knotted_laws();
    laws.tensile[0] = laws.tensile[1] = {60, {}};  // so that shear matters
    const PaperCloth cloth(grid, laws);
    const Particles x = shaped(grid, [&](double u, double v) {
      return Vector3d(1.005 * u + shear * v, 1.003 * v, 0.002 * std::sin(60 * u));
    });
    EXPECT_GT(cloth.stiffness_bound_per_s2(cloth.strains(x)),
              0.999 * highest_frequency_squared(cloth, x))
        << shear;
  }
}

/// Holds these particles at their positions.
void hold(PaperMotion& motion, const std::vector<int>& particles) {
  Eigen::MatrixXd weights =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(particles.size()), motion.position.cols());
  for (std::size_t k = 0; k < particles.size(); ++k)
    weights(static_cast<Eigen::Index>(k), particles[k]) = 1;
  motion.hold(weights);
}

/// Steps with kinetic damping until the residual is below the tolerance.
bool settle(PaperMotion& motion, double tolerance, long limit) {
  double before = 0;
  bool rising = false;
  for (long k = 0; k < limit; ++k) {
    motion.step(0.9, 1);
    const double now = motion.kinetic_j();
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

TEST(PaperMotion, HangingStripStretchesByItsWeight) {
  // A chain of n equal masses m per line with stiffness K w / l between neighbours: particle j
  // below the top bears n - j of them, so the tip drops by m g l / (K w) n (n - 1) / 2. Border
  // lines are as stiff as inner ones.
  const double density = 0.138, stiffness = 400;
  const ParticleGrid grid{11, 3, {0.2, 0.03}};
  const PaperCloth cloth(grid, linear_laws(density, stiffness, 1e-9, 1e-6), 1e-4);
  const Surroundings nothing;
  PaperMotion motion(cloth, nothing, {{kG, 0, 0}, 4, 0, 0});
  motion.position = flat(grid);
  hold(motion, {0, 1, 2});
  ASSERT_TRUE(settle(motion, 1e-7, 200000));
  const double drop = cloth.particle_kg() * kG * grid.spacing_m().x() /
                      (stiffness * grid.spacing_m().y()) * 11 * 10 / 2;
  EXPECT_NEAR(motion.position(0, 31) - 0.2, drop, 1e-4 * drop);
}

TEST(PaperMotion, CantileverFollowsTheMasterCurve) {
  const Csv curve =
      read_csv(drape::test::test_data("physics") / "cantilever_master_curve.csv",
               {"Gamma", "W_over_L", "H_over_L", "H_over_W", "theta_tip_rad", "M_clamp_L_over_B"});
  const auto master = [&curve](double gamma) {
    const std::vector<double>& g = curve.columns[0];
    std::size_t i = 1;
    while (g[i] < gamma) ++i;
    const double t = (gamma - g[i - 1]) / (g[i] - g[i - 1]);
    return curve.columns[3][i - 1] + t * (curve.columns[3][i] - curve.columns[3][i - 1]);
  };
  // Two rows are held, and the clamp is half a cell before the hinge of the second one. The mass of
  // total / particles makes each line of the strip heavier than the cloth it represents by rows
  // cols / ((rows - 1) cols), with the stiffness of as much; the last row has twice the mass that a
  // strip of area masses has there, 1 / (rows - 1.5) of the weight.
  const double density = 0.138, bending = 7.7e-6;
  for (const double gamma : {1.0, 10.0}) {
    const double length = std::cbrt(gamma * bending / (density * kG));
    constexpr int kSheetRows = 62, kSheetCols = 3;
    const double spacing = length / (kSheetRows - 1.5);
    const ParticleGrid grid{kSheetRows, kSheetCols, {spacing * (kSheetRows - 1), 0.01}};
    // Weight per line relative to that of its width of cloth.
    const double heavier = (kSheetRows - 1.0) / kSheetRows * kSheetCols / (kSheetCols - 1.0);
    const PaperCloth cloth(grid, linear_laws(density * heavier, 3000, 30, bending), 2e-6);
    const Surroundings nothing;
    PaperMotion motion(cloth, nothing, {{0, 0, -kG}, 4, 0, 0});
    motion.position = flat(grid);
    hold(motion, {0, 1, 2, 3, 4, 5});
    ASSERT_TRUE(settle(motion, 1e-2, 2000000));
    const Vector3d tip = motion.position.col((kSheetRows - 1) * kSheetCols + 1);
    const double ratio = -tip.z() / (tip.x() - 0.5 * spacing);
    EXPECT_NEAR(ratio, master(gamma), 0.06 * master(gamma)) << "Gamma " << gamma;
  }
}

TEST(PaperMotion, EnergyIsKeptWithoutDampingAndFallsWithIt) {
  const ParticleGrid grid{8, 8, {0.1, 0.1}};
  // Without a shear force Kdiag is constant, so that the energy is a potential.
  const PaperCloth cloth(grid, linear_laws(0.138, 2000, 1e-9, 7.7e-6));
  const Surroundings nothing;
  for (const double damping : {0.0, 5.0}) {
    PaperMotion motion(cloth, nothing, {{0, 0, -kG}, damping, 0, 0});
    motion.position = flat(grid);
    hold(motion, {0, 7});
    const auto energy = [&] {
      return motion.kinetic_j() + motion.gravity_j() + cloth.energies(motion.position).sum_j();
    };
    const double start = energy(), scale = cloth.particle_kg() * grid.count() * kG * 0.1;
    double before = start;
    for (int k = 0; k < 4000; ++k) {
      motion.step(1, 2e-5);
      const double now = energy();
      if (damping > 0) {
        ASSERT_LT(now, before + 1e-9 * scale);
      }
      before = now;
    }
    if (damping == 0) {
      EXPECT_NEAR(before, start, 1e-5 * scale);
    } else {
      EXPECT_NEAR(start - before, motion.viscous_j(), 1e-3 * (start - before));
    }
  }
}

TEST(PaperMotion, FreeFallKeepsMomentumOfTheWholeSheet) {
  const ParticleGrid grid{6, 5, {0.1, 0.1}};
  const PaperCloth cloth(grid, linear_laws(0.138, 2000, 30, 7.7e-6));
  const Surroundings nothing;
  PaperMotion motion(cloth, nothing, {{0, 0, -kG}, 0, 0, 0});
  motion.position = flat(grid);
  for (Eigen::Index i = 0; i < motion.velocity.size(); ++i)
    motion.velocity(i) = 0.1 * std::sin(static_cast<double>(i));
  const auto momentum = [&]() -> Vector3d {
    return cloth.particle_kg() * motion.velocity.rowwise().sum();
  };
  const Vector3d start = momentum();
  double time = 0;
  for (int k = 0; k < 1000; ++k) time += motion.step(1, 3e-5);
  const Vector3d expected = start + cloth.particle_kg() * grid.count() * time * Vector3d(0, 0, -kG);
  EXPECT_LT((momentum() - expected).norm(), 1e-10 * expected.norm());
}

/// A small stiff sheet on the table; gravity is tilted instead of the table.
struct Block {
  ParticleGrid grid{3, 3, {0.02, 0.02}};
  PaperCloth cloth{grid, linear_laws(0.2, 2000, 30, 1e-4)};
  Surroundings table;
  PaperMotion motion;

  explicit Block(const Vector3d& gravity, double friction = 0.4)
      : motion(cloth, with_table(table), {gravity, 0, 0, friction}) {
    motion.position = flat(grid, 1e-9);
  }
  static const Surroundings& with_table(Surroundings& around) {
    around.add(Table{0});
    return around;
  }
  static Vector3d tilted(double slope) {
    return kG * Vector3d(std::sin(slope), 0, -std::cos(slope));
  }
};

TEST(PaperMotion, ABlockOnAnInclineSticksBelowTheAngleOfFriction) {
  Block block(Block::tilted(0.99 * std::atan(0.4)));
  for (int k = 0; k < 5000; ++k) block.motion.step(1, 5e-5);
  EXPECT_NEAR(block.motion.position(0, 4), 0.01, 1e-6);
  EXPECT_LT(block.motion.residual(), 1e-9);
}

TEST(PaperMotion, ABlockOnAnInclineSlidesAsCoulombSays) {
  const double slope = 0.7, pull = std::sin(slope) - 0.4 * std::cos(slope);
  Block block(Block::tilted(slope));
  double time = 0;
  for (int k = 0; k < 4000; ++k) time += block.motion.step(1, 5e-5);
  const double displacement = 0.5 * kG * pull * time * time;
  EXPECT_NEAR(block.motion.position(0, 4) - 0.01, displacement, 0.01 * displacement);
  EXPECT_GT(block.motion.residual(), 0.1);
}

TEST(PaperMotion, ASlidingBlockStopsAfterItsBrakingDistance) {
  const double speed = 0.3, displacement = speed * speed / (2 * 0.4 * kG);
  Block block({0, 0, -kG});
  block.motion.velocity.row(0).setConstant(speed);
  for (int k = 0; k < 4000; ++k) block.motion.step(1, 5e-5);
  EXPECT_NEAR(block.motion.position(0, 4) - 0.01, displacement, 0.01 * displacement);
  EXPECT_EQ(block.motion.kinetic_j(), 0);
}

TEST(PaperMotion, LiftedParticlesAreReleased) {
  Block block({0, 0, kG}, 0.3);
  for (int k = 0; k < 1000; ++k) block.motion.step(1, 2e-5);
  EXPECT_EQ(block.motion.contacts(), 0);
  EXPECT_NEAR(block.motion.position(2, 4), 0.5 * kG * 0.02 * 0.02, 2e-9);
}

TEST(PaperMotion, ASheetGoesBackToTheImpactAndStaysOnTheTable) {
  const ParticleGrid grid{5, 5, {0.05, 0.05}};
  const PaperCloth cloth(grid, linear_laws(0.138, 2000, 30, 7.7e-6));
  Surroundings table;
  table.add(Table{0.01});
  PaperMotion motion(cloth, table, {{0, 0, -kG}, 0, 0, 0.3});
  motion.position = flat(grid, 0.012);
  motion.velocity.row(2).setConstant(-1);
  for (int k = 0; k < 1000; ++k) motion.step(1, 1e-4);
  EXPECT_EQ(motion.contacts(), grid.count());
  EXPECT_GT(motion.backtracked_steps(), 0);
  EXPECT_LT((motion.position.row(2).array() - 0.01).abs().maxCoeff(), 1e-9);
  EXPECT_LT(motion.residual(), 1e-6);
}

/// A sheet folded over itself, with its upper half falling at `speed` onto the lower one.
TEST(PaperMotion, LayersComeToRestAThicknessApart) {
  const ParticleGrid grid{21, 5, {0.1, 0.02}};
  constexpr double kThickness = 0.5e-3;
  for (const double speed : {0.0, 0.5}) {
    const PaperCloth cloth(grid, linear_laws(0.138, 2000, 30, 1e-9), 1e-5);
    Surroundings table;
    table.add(Table{0});
    PaperMotion motion(cloth, table, {{0, 0, -kG}, 20, 0, 0.3, kThickness});
    const double fold = 0.05, radius = 2e-3, bend = std::numbers::pi * radius;
    motion.position = shaped(grid, [&](double u, double v) {
      const double over = u - fold;
      if (over < 0) return Vector3d(u, v, 1e-6);
      if (over < bend)
        return Vector3d(fold + radius * std::sin(over / radius), v,
                        1e-6 + radius * (1 - std::cos(over / radius)));
      return Vector3d(fold - (over - bend), 1e-3 + v, 1e-6 + 2 * radius);
    });
    for (Eigen::Index i = 0; i < motion.position.cols(); ++i)
      if (motion.position(2, i) > 1.9 * radius) motion.velocity(2, i) = -speed;
    ASSERT_TRUE(settle(motion, 1e-3, 60000)) << speed;
    // The far end of the upper half is on the lower one, and nowhere below it.
    const double height = motion.position(2, grid.count() - 3);
    EXPECT_LT(height, 1.2 * kThickness) << speed;
    EXPECT_GT(height, 0.9 * kThickness) << speed;
    EXPECT_GT(motion.layers_j(), 0) << speed;
  }
}

TEST(PaperMotion, TheStepIsWithinItsLimit) {
  const ParticleGrid grid{21, 21, {0.2, 0.2}};
  const double limit = std::numbers::sqrt2 * grid.spacing_m().x() * std::sqrt(0.138 / 2000);
  const PaperCloth cloth(grid, linear_laws(0.138, 2000, 1e-6, 1e-9));
  const Surroundings nothing;
  PaperMotion motion(cloth, nothing, {{0, 0, 0}, 0, 0, 0});
  motion.position = flat(grid);
  // Particles are lighter than the cloth between them by the factor (n - 1)^2 / n^2, n = 21.
  EXPECT_NEAR(motion.step(1, 1), limit * 20 / 21, 0.03 * limit);
}

/// A drape of a scene of rigs/paper.
struct Draped {
  Scene scene;
  LocalScene local;
  Certificate certificate;
  PaperDrape drape;

  explicit Draped(const Scene& world, const PaperOptions& options, int segments = 1)
      : scene(world), local(local_scene(world, std::nullopt, Surroundings(world).top_z_m())) {
    const FittedLaws fitted = fit_laws(read_fabric(world.fabric_file), segments);
    drape = run_paper_model(local, read_print(world.print_file), fitted.laws, options, certificate);
  }
};

Scene scene_of_paper(const char* name) {
  return read_scene(drape::test::source_root() / "rigs/paper/scenes" / name);
}
PaperOptions coarse() {
  PaperOptions options;
  options.rows = options.cols = 11;
  return options;
}

TEST(PaperModel, RestsOnTheCubeInItsOwnResidual) {
  const Draped run(scene_of_paper("C.toml"), coarse());
  const Certificate& c = run.certificate;
  EXPECT_TRUE(c.at_rest) << c.status;
  EXPECT_LT(c.residual.value_or(1), 1e-3);
  EXPECT_GT(c.distances->to_object_m.value_or(-1), -0.1 * mm);
  // Only particles collide: the cells between them cross the edges of the cube.
  EXPECT_GT(c.distances->deepest_m, 0.5 * mm);
  EXPECT_EQ(std::get<CertificateGrid>(c.cloth).rows, 11);
  ASSERT_EQ(run.drape.sheet.marks.size(), 121U);
  EXPECT_LT(run.drape.history.back().residual, 1e-3);
  EXPECT_LT(*c.energies->internal_j + run.drape.history.back().gravity_j, *c.energies->start_j);
}

TEST(PaperModel, PinsHoldWhereTheyAreCarried) {
  const Draped run(scene_of_paper("D.toml"), coarse());
  EXPECT_TRUE(run.certificate.at_rest) << run.certificate.status;
  EXPECT_LT(run.certificate.distances->hold_error_m, 1e-9);
  // The sheet hangs below both.
  for (const Pin& pin : run.scene.pins)
    for (const SheetMark& mark : run.drape.sheet.marks)
      EXPECT_LT(run.local.to_world(mark.point_in_world).z(), pin.point_in_world->z() + 1e-9);
}

TEST(PaperModel, ARunThatGetsNoFurtherSaysSo) {
  PaperOptions options = coarse();
  options.max_steps = 200;
  const Draped run(scene_of_paper("C.toml"), options);
  EXPECT_FALSE(run.certificate.at_rest);
  EXPECT_NE(run.certificate.status.find("not at rest after 200 steps"), std::string::npos)
      << run.certificate.status;
}

TEST(PaperModel, RefusesClamps) {
  Scene scene = scene_of_paper("D.toml");
  scene.clamps.emplace_back();
  EXPECT_THROW(Draped(scene, coarse()), Error);
}

}  // namespace
}  // namespace drape::simulate
