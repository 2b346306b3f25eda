// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/error.hpp"
#include "simulate/simulate.hpp"
#include "simulate/surroundings.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape {
namespace {

using Eigen::Vector3d;

/// Seeded by the trial, with its own arithmetic: the same numbers with every standard library.
class Dice {
 public:
  explicit Dice(int trial) : engine_(static_cast<unsigned>(trial) + 1U) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967295.0;
  }
  int below(int count) { return static_cast<int>(engine_() % static_cast<unsigned>(count)); }

 private:
  std::mt19937 engine_;
};

struct Trial {
  Scene scene;
  Fabric fabric;
  Print print;
  SimulateOptions options;
};

Trial valid_trial(Dice& dice) {
  static const std::filesystem::path bench = test::source_root() / "rigs/bench1";
  static const Scene scene = read_scene(bench / "scenes/A.toml");
  static const Fabric fabric = read_fabric(scene.fabric_file);
  Trial trial{scene, fabric, read_print(scene.print_file), {}};
  trial.scene.friction = dice.between(0, 1);
  trial.scene.table_z_m = dice.between(-0.3, 0);
  trial.scene.obstacles.clear();
  const double size = dice.between(0.03, 0.12);
  switch (dice.below(3)) {
    case 0:
      trial.scene.obstacles.emplace_back(Sphere{{0, 0, 0}, 0.5 * size});
      break;
    case 1:
      trial.scene.obstacles.emplace_back(Box{{}, Vector3d::Constant(size), 0.001});
      break;
    default:
      trial.scene.obstacles.emplace_back(Cylinder{{}, 0.5 * size, size, 0.001});
  }
  const double top = 0.5 * size + 0.002;
  trial.scene.start = {StartMode::flat, 0, Vector3d(dice.between(-0.02, 0.02), 0, top),
                       dice.between(-3, 3)};
  trial.options.rows = 3 + dice.below(6);
  trial.options.cols = 3 + dice.below(6);
  trial.options.segments = 1 + dice.below(5);
  trial.options.max_steps = 1500;
  return trial;
}

void spoil(Trial& trial, Dice& dice) {
  const double wild[] = {0.0, std::numeric_limits<double>::quiet_NaN(),
                         std::numeric_limits<double>::infinity(), 1e12, -1.0};
  const double value = wild[dice.below(5)];
  switch (dice.below(8)) {
    case 0:
      trial.fabric.areal_density_kg_per_m2 = value;
      break;
    case 1:
      for (double& f : trial.fabric.tensile[dice.below(2)].loading) f *= value;
      break;
    case 2:
      for (double& f : trial.fabric.bending[dice.below(2)].loading) f *= value;
      break;
    case 3:
      for (double& f : trial.fabric.shear[dice.below(2)].loading) f *= value;
      break;
    case 4:
      trial.print.patch_m[dice.below(2)] = value;
      break;
    case 5:
      trial.scene.friction = value;
      break;
    case 6:
      trial.scene.start.centre_in_world = Vector3d(0, 0, value);
      break;
    default:
      trial.scene.start.centre_in_world = Vector3d(0, 0, 0.001);  // inside the object
  }
}

/// Whatever was put in: an Error, or finite points whose status is true.
void expect_honest(const Trial& trial, int index) {
  try {
    const SimulateResult result =
        simulate(trial.scene, trial.fabric, trial.print, std::nullopt, trial.options);
    const bool rest = result.report.status == RestStatus::at_rest;
    for (const SheetMark& mark : result.sheet.marks) {
      EXPECT_TRUE(mark.point_in_world.allFinite()) << "trial " << index;
    }
    if (!rest) return;
    EXPECT_LT(result.report.residual, trial.options.residual_tolerance) << "trial " << index;
    const sim::Surroundings objects(trial.scene);
    for (const SheetMark& mark : result.sheet.marks) {
      for (int shape = 0; shape < objects.count(); ++shape) {
        EXPECT_GT(objects.gap_m(shape, mark.point_in_world), -1e-4) << "trial " << index;
      }
    }
  } catch (const Error&) {  // refused in words
  }
}

TEST(RandomScenes, ValidOnesEndFiniteAndHonest) {
  const int count = test::trial_count(40, 10000);
  for (int index = 0; index < count; ++index) {
    Dice dice(index);
    expect_honest(valid_trial(dice), index);
  }
}

TEST(RandomScenes, HostileOnesAreRefusedOrEndFinite) {
  const int count = test::trial_count(60, 10000);
  for (int index = 0; index < count; ++index) {
    Dice dice(100000 + index);
    Trial trial = valid_trial(dice);
    spoil(trial, dice);
    expect_honest(trial, index);
  }
}

}  // namespace
}  // namespace drape
