// SPDX-License-Identifier: Apache-2.0
// An edge held along a line: the free length begins at the line, at any grid, by every solver.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "core/units.hpp"
#include "simulate/cloth/clamp.hpp"
#include "simulate/ensemble/checked.hpp"
#include "simulate/equilibrium/hessian.hpp"
#include "simulate/start/clamps.hpp"
#include "simulate/validation/test_door.hpp"
#include "simulate/validation/test_exact.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kStrip = 0.1;  // m
constexpr double kGamma = 10;

/// A strip whose warp runs along -y; the stretch by its weight is below 1e-5 of its length.
DoorCase strip(int rows, double length = kStrip) {
  DoorCase c;
  c.rows = rows;
  c.spacing_m = length / (rows - 1);
  c.bending_n_m = c.density_kg_per_m2 * kGravity * std::pow(kStrip, 3) / kGamma;
  c.tensile.slope = 1e5 * c.density_kg_per_m2 * kGravity * kStrip;
  c.starts_flat = true;
  c.start = [c](double u, double v) { return c.flat_place(u, v); };
  return c;
}

/// Held along the row of particles at warp `u`, level.
Clamp level_clamp(const DoorCase& c, double u) {
  const double width = c.grid().patch_m.y();
  return {{u, 0}, {u, width}, c.flat_place(u, 0), c.flat_place(u, width), {0, -1, 0}};
}

DoorCase clamped(int rows) {
  DoorCase c = strip(rows);
  c.clamps = {level_clamp(c, 0)};
  return c;
}

/// Distance of the tip from that of the heavy elastica, over the length.
double tip_error(const DoorCase& c, const DoorRun& run) {
  EXPECT_TRUE(run.rests) << run.sentence;
  const exact::Cantilever shape = exact::cantilever(kGamma);
  const Vector3d tip = at(run.position, (c.rows - 1) * c.cols + 1);
  return std::hypot((c.flat_place(0, 0).y() - tip.y()) / kStrip - shape.width,
                    -tip.z() / kStrip - shape.height);
}

TEST(Clamp, AHeavyStripConvergesWithOrderTwoFromTheLine) {
  std::vector<double> errors, pinned;
  for (const int rows : {11, 21, 41, 81}) {
    const DoorCase c = clamped(rows);
    errors.push_back(tip_error(c, run_door_case(c, Solver::newton, {0, 0, 0})));
    DoorCase two_rows = strip(rows);
    for (int i = 0; i < 2 * two_rows.cols; ++i) two_rows.pinned.push_back(i);
    pinned.push_back(tip_error(two_rows, run_door_case(two_rows, Solver::newton, {0, 0, 0})));
    std::printf("%d rows: tip %.6f L beside the elastica clamped, %.6f with two rows pinned\n",
                rows, errors.back(), pinned.back());
  }
  // An error of order 2 falls to a quarter; 1.8 is the goal of the project's order studies.
  for (std::size_t k = 1; k < errors.size(); ++k) {
    EXPECT_GE(std::log2(errors[k - 1] / errors[k]), 1.8) << k;
    EXPECT_LT(errors[k], pinned[k]);
  }
}

// The weight moves the tip by less than the length, so a residual of 1e-4 of the weight, as
// Runge-Kutta is asked for, by less than 1e-4 of it.
TEST(Clamp, AllSolversFindTheSameStrip) {
  const DoorCase c = clamped(11);
  const DoorRun reference = run_door_case(c, Solver::newton, {0, 0, 0});
  ASSERT_TRUE(reference.rests) << reference.sentence;
  for (const Solver solver : {Solver::fall, Solver::rk4}) {
    const DoorRun run = run_door_case(c, solver, {0.3, -0.2, 1});
    EXPECT_TRUE(run.rests) << drape::name_of(solver) << ": " << run.sentence;
    for (int i = 0; i < c.rows * c.cols; ++i)
      EXPECT_LT((at(run.position, i) - at(reference.position, i)).norm(), 1e-4 * kStrip)
          << drape::name_of(solver);
  }
}

// A clamp inside parts the sheet: each side is the strip of half the length.
TEST(Clamp, ALineInsideHoldsBothSides) {
  DoorCase both = strip(41, 2 * kStrip);
  both.clamps = {level_clamp(both, kStrip)};
  const DoorRun run = run_door_case(both, Solver::newton, {0, 0, 0});
  ASSERT_TRUE(run.rests) << run.sentence;
  const DoorCase one = clamped(21);
  const DoorRun half = run_door_case(one, Solver::newton, {0, 0, 0});
  const Vector3d shift = one.flat_place(0, 0) - both.flat_place(kStrip, 0);
  for (int row = 0; row < 21; ++row) {
    const Vector3d alone = at(half.position, 3 * row + 1);
    const Vector3d after = at(run.position, 3 * (20 + row) + 1) + shift;
    Vector3d before = at(run.position, 3 * (20 - row) + 1) + shift;
    before.y() = 2 * one.flat_place(0, 0).y() - before.y();
    // Both are at rest to 1e-6 of a weight, see above.
    EXPECT_LT((after - alone).norm(), 2e-6 * kStrip) << row;
    EXPECT_LT((before - alone).norm(), 2e-6 * kStrip) << row;
  }
}

// A flat start of a strip that is clamped upwards: it may not stay bent back at the clamp.
TEST(Clamp, HoldsTheSideOfTheSheetToo) {
  for (const Vector3d& direction : {Vector3d(0, 0, 1), Vector3d(0, 0.6, 0.8)}) {
    DoorCase c = strip(41);
    c.bending_n_m *= 5;  // Gamma 2: stands or nearly so
    c.clamps = {level_clamp(c, 0)};
    c.clamps[0].direction_in_world = direction;
    const DoorRun run = run_door_case(c, Solver::fall, {0, 0, 0});
    ASSERT_TRUE(run.rests) << run.sentence;
    const Vector3d edge = at(run.position, 4) - at(run.position, 1);
    EXPECT_GT(edge.normalized().dot(direction), 0.9) << direction.transpose();
  }
}

ClothLaws bent_laws() {
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.15;
  laws.tensile[0] = {1500, {}};
  laws.tensile[1] = {900, {}};
  laws.shear = {40, {}};
  laws.bending[0] = {8e-6, {{30, -2e-6}}};
  laws.bending[1] = {5e-6, {{20, 3e-6}}};
  laws.twist_n_m = 9e-6;
  return laws;
}

TEST(Clamp, ForcesAndSecondDerivativesAreThoseOfItsEnergy) {
  const GridSpec grid{5, 5, {0.02, 0.03}};
  Scene scene;
  scene.clamps = {{{0.01, 0}, {0.01, 0.03}, {0, 0, 0}, {0.03, 0, 0}, {0, 0.6, 0.8}},
                  {{0, 0.03}, {0.01, 0.03}, {0.03, 0, 0.01}, {0.03, 0, 0}, {0.8, 0.6, 0}}};
  Cloth cloth(grid, bent_laws(), MassRule::area);
  cloth.clamp(clamps_on(scene, grid).places);
  ASSERT_EQ(cloth.clamped_places().size(), 13U);
  std::mt19937 engine(7);
  std::uniform_real_distribution<double> shake(-0.01, 0.01);
  for (int trial = 0; trial < 20; ++trial) {
    Field x(3 * 25), displacement(3 * 25);
    for (double& value : x) value = shake(engine);
    for (double& value : displacement) value = shake(engine);
    const auto moved = [&](double step) {
      Field there = x;
      for (std::size_t k = 0; k < x.size(); ++k) there[k] += step * displacement[k];
      return there;
    };
    const auto slope_at = [&](double step) {
      Field force(x.size(), 0.0);
      cloth.add_forces(moved(step), nullptr, force);
      double sum = 0;
      for (std::size_t k = 0; k < x.size(); ++k) sum -= force[k] * displacement[k];
      return sum;
    };
    // Central differences err by the square of the step, here 1e-8.
    constexpr double kStep = 1e-4;
    const double of_energy =
        (cloth.energies(moved(kStep)).sum_j() - cloth.energies(moved(-kStep)).sum_j()) /
        (2 * kStep);
    EXPECT_NEAR(slope_at(0), of_energy, 1e-5 * std::abs(of_energy)) << trial;
    GridMatrix hessian(grid);
    add_hessian(cloth, x, false, hessian);
    Eigen::VectorXd direction(75), product;
    for (int i = 0; i < 25; ++i) direction.segment<3>(3 * i) = at(displacement, i);
    hessian.multiply(direction, product);
    const double curve = direction.dot(product);
    EXPECT_NEAR((slope_at(kStep) - slope_at(-kStep)) / (2 * kStep), curve, 1e-3 * std::abs(curve))
        << trial;
    for (const ClampedPlace& place : cloth.clamped_places()) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> own(clamped_hessian(cloth, place, x));
      EXPECT_GE(own.eigenvalues()[0], -1e-9 * own.eigenvalues()[2]);
    }
  }
}

/// A square of cloth clamped along its hem at warp 0, out of files that a test may change.
struct Held {
  Held()
      : folder(test::test_data("independent-drapes")),
        scene(read_scene(folder / "hang.toml")),
        fabric(read_fabric(scene.fabric_file)),
        print(read_print(scene.print_file)) {
    scene.pins.clear();
    scene.clamps = {{{0, 0}, {0, 0.2}, {-0.1, 0.1, 0.2}, {0.1, 0.1, 0.2}, {0, -1, 0}}};
    options.rows = options.cols = 11;
    options.segments = 1;
    options.solver = Solver::newton;
  }
  [[nodiscard]] SimulateResult run() const {
    return simulate_checked(scene, fabric, print, std::nullopt, options);
  }
  [[nodiscard]] std::string fault() const {
    try {
      static_cast<void>(run());
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path folder;
  Scene scene;
  Fabric fabric;
  Print print;
  SimulateOptions options;
};

// Stretch, shear, bending and twist at once, under a weight that its bends resolve: the length that
// bending and weight make, (B / rho g)^(1/3), is 5 spacings of 21 particles. 1.8 as above.
TEST(Clamp, ABentAndTwistedSheetConvergesWithOrderTwo) {
  std::vector<Vector3d> corners;
  for (const int side : {11, 21, 41}) {
    Held held;
    held.options.rows = held.options.cols = side;
    held.scene.gravity_m_per_s2 = {0.025 * kGravity, 0, -0.04 * kGravity};
    const SimulateResult drape = held.run();
    EXPECT_EQ(drape.report.status, RestStatus::at_rest) << drape.report.sentence;
    corners.push_back(drape.sheet.marks.back().point_in_world);
  }
  const double coarse = (corners[0] - corners[1]).norm(), fine = (corners[1] - corners[2]).norm();
  std::printf("free corner of a clamped sheet: %.4f mm from 11 to 21, %.4f from 21 to 41\n",
              coarse / mm, fine / mm);
  EXPECT_GE(std::log2(coarse / fine), 1.8);
}

TEST(Clamp, MovedOrTurnedByLittleIsRefusedByTheChecker) {
  const Held held;
  const SimulateResult drape = held.run();
  ASSERT_EQ(drape.report.status, RestStatus::at_rest) << drape.report.sentence;
  const CertificateClaim claim = claim_of(drape, held.options);
  const auto accepted = [&](const Scene& scene) {
    return certify(drape.sheet, scene, held.fabric, held.print, claim).accepted();
  };
  EXPECT_TRUE(accepted(held.scene));
  Scene moved = held.scene;
  moved.clamps[0].from_in_world.z() += 2e-6;
  EXPECT_FALSE(accepted(moved));
  Scene turned = held.scene;
  turned.clamps[0].direction_in_world =
      Eigen::AngleAxisd(1e-4, Vector3d::UnitX()) * Vector3d(0, -1, 0);
  EXPECT_FALSE(accepted(turned));
  Scene without = held.scene;
  without.clamps.clear();
  EXPECT_FALSE(accepted(without));
  Scene beside = held.scene;
  beside.clamps[0].from_material_m.x() = beside.clamps[0].to_material_m.x() = 0.003;
  EXPECT_FALSE(accepted(beside));
}

TEST(Clamp, AMovedAndTurnedWorldHasTheSameShape) {
  const Held here;
  Held there;
  const Eigen::AngleAxisd turn(37 * kPi / 180, Vector3d::UnitZ());
  const Vector3d move(0.3, -0.2, 1);
  for (Clamp& clamp : there.scene.clamps)
    clamp = {clamp.from_material_m, clamp.to_material_m, turn * clamp.from_in_world + move,
             turn * clamp.to_in_world + move, turn * clamp.direction_in_world};
  there.scene.start.centre_in_world = turn * *there.scene.start.centre_in_world + move;
  there.scene.start.yaw_rad += turn.angle();
  there.scene.table_z_m += move.z();
  const SimulateResult a = here.run(), b = there.run();
  EXPECT_EQ(a.report.status, RestStatus::at_rest) << a.report.sentence;
  EXPECT_EQ(b.report.status, RestStatus::at_rest) << b.report.sentence;
  for (std::size_t k = 0; k < a.sheet.marks.size(); ++k)
    EXPECT_LT(
        (turn * a.sheet.marks[k].point_in_world + move - b.sheet.marks[k].point_in_world).norm(),
        1e-9);
}

// Too coarse for the bend, the sheet can end folded flat in the clamp, where its curvature no
// longer changes with the angle.
TEST(Clamp, ASheetFoldedBackInItIsRefused) {
  const std::filesystem::path rig = test::source_root() / "rigs/paper";
  Scene scene = read_scene(rig / "scenes/A.toml");
  scene.obstacles.clear();
  scene.table_z_m = -1;
  scene.start = {StartMode::flat, 0, Vector3d(0.003, 0.002, 0), 0};
  scene.clamps = {{{0, 0}, {0, 0.2}, {-0.1, 0.1, 0}, {0.1, 0.1, 0}, {0, 0, 1}}};
  SimulateOptions options;
  options.segments = 1;
  options.solver = Solver::fall;
  const SimulateResult result = simulate_checked(
      scene, read_fabric(scene.fabric_file), read_print(scene.print_file), std::nullopt, options);
  EXPECT_EQ(result.report.status, RestStatus::refused) << result.report.sentence;
  EXPECT_NE(result.report.sentence.find("leaves a clamp"), std::string::npos);
  EXPECT_TRUE(std::any_of(
      result.report.warnings.begin(), result.report.warnings.end(),
      [](const std::string& text) { return text.find("unresolved") != std::string::npos; }));
}

TEST(Clamp, ThatNoGridCanHoldIsNamed) {
  const auto fault_of = [](const std::function<void(Clamp&)>& change) {
    Held held;
    change(held.scene.clamps[0]);
    return held.fault();
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(fault_of([](Clamp&) {}), "");
  EXPECT_TRUE(has(fault_of([](Clamp& c) { c.to_material_m = {0.1, 0.2}; }), "crosses the threads"));
  EXPECT_TRUE(has(fault_of([](Clamp& c) { c.to_material_m = {0, 0.3}; }), "the patch is"));
  EXPECT_TRUE(has(fault_of([](Clamp& c) { c.to_material_m = {0, 0}; }), "has no length"));
  EXPECT_TRUE(has(fault_of([](Clamp& c) { c.to_in_world = c.from_in_world; }), "has no length"));
  EXPECT_TRUE(has(fault_of([](Clamp& c) {
                    c.direction_in_world = {1, 0, 0};
                  }),
                  "left along itself"));
  EXPECT_TRUE(has(fault_of([](Clamp& c) { c.from_material_m.x() = c.to_material_m.x() = 0.033; }),
                  "7 mm beside the nearest row"));
  Held held;
  held.options.solver = Solver::fall;
  held.options.internal_friction = true;
  EXPECT_TRUE(has(held.fault(), "internal friction"));
}

}  // namespace
}  // namespace drape::simulate
