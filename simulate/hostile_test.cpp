// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "simulate/simulate.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

/// Random numbers seeded by the trial, with its own arithmetic: equal with every standard library.
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
  std::optional<Sheet> measured;
};

/// Mesh file of a four-sided pyramid of 80 x 80 x 60 mm, apex up.
const std::filesystem::path& pyramid() {
  static const test::TemporaryFolder folder;
  static const std::filesystem::path file = folder.path() / "pyramid.obj";
  if (!std::filesystem::exists(file)) {
    write_durable(file,
                  "v -40 -40 0\nv 40 -40 0\nv 40 40 0\nv -40 40 0\nv 0 0 60\n"
                  "f 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n");
  }
  return file;
}

void place_object(Trial& trial, Dice& dice) {
  const double size = dice.between(0.03, 0.12);
  const double rounding = dice.below(2) == 0 ? 0.001 : 0.0;
  double top = 0.5 * size;
  std::vector<Obstacle>& objects = trial.scene.obstacles;
  objects.clear();
  switch (dice.below(4)) {
    case 0:
      objects.emplace_back(Sphere{{0, 0, 0}, 0.5 * size});
      break;
    case 1:
      objects.emplace_back(Box{{}, Vector3d::Constant(size), rounding});
      break;
    case 2:
      objects.emplace_back(Cylinder{{}, 0.5 * size, size, rounding});
      break;
    default:
      objects.emplace_back(MeshObject{pyramid(), {}});
      top = 0.06;
  }
  trial.scene.start = {StartMode::flat, 0, Vector3d(dice.between(-0.02, 0.02), 0, top + 0.002),
                       dice.between(-3, 3)};
}

Trial valid_trial(Dice& dice, int most_steps) {
  static const std::filesystem::path bench = test::source_root() / "rigs/bench1";
  static const Scene scene = read_scene(bench / "scenes/A.toml");
  static const Fabric fabric = read_fabric(scene.fabric_file);
  Trial trial{scene, fabric, read_print(scene.print_file), {}, std::nullopt};
  trial.scene.friction = dice.between(0, 1);
  trial.scene.table_z_m = dice.between(-0.3, 0);
  place_object(trial, dice);
  trial.options.segments = 1 + dice.below(5);
  trial.options.drape.spacing_m = trial.options.drape.coarsest_m =
      dice.below(2) == 0 ? 15e-3 : 20e-3;
  trial.options.drape.descent.most_steps = most_steps;
  trial.options.paper.rows = 3 + dice.below(6);
  trial.options.paper.cols = 3 + dice.below(6);
  trial.options.paper.max_steps = 10L * most_steps;
  if (dice.below(4) == 0) trial.options.model = ClothModel::paper;
  return trial;
}

/// Sets a measured sheet as start: flat above the object, then damaged.
void start_from_spoiled_sheet(Trial& trial, Dice& dice, double value) {
  Sheet sheet;
  sheet.rows = trial.print.rows;
  sheet.cols = trial.print.cols;
  sheet.patch_m = trial.print.patch_m;
  const int kind = dice.below(3);
  for (int r = 0; r < sheet.rows; ++r) {
    for (int c = 0; c < sheet.cols; ++c) {
      SheetMark mark;
      mark.mark = {r, c};
      mark.material_m = trial.print.material_m(mark.mark);
      mark.point_in_world = {mark.material_m.y() - 0.1, 0.1 - mark.material_m.x(), 0.07};
      if (kind == 0) mark.point_in_world = Vector3d(0, 0, 0.07);  // cells without area
      sheet.marks.push_back(mark);
    }
  }
  const int count = static_cast<int>(sheet.marks.size());
  if (kind == 1) {  // inverted cells
    for (int k = 0; k < 20; ++k) {
      std::swap(sheet.marks[dice.below(count)].point_in_world,
                sheet.marks[dice.below(count)].point_in_world);
    }
  }
  if (kind == 2) sheet.marks[dice.below(count)].point_in_world[dice.below(3)] = value;
  trial.scene.start = {StartMode::measured, 0, std::nullopt, 0};
  trial.measured = sheet;
}

void spoil(Trial& trial, Dice& dice) {
  const double wild[] = {0.0, std::numeric_limits<double>::quiet_NaN(),
                         std::numeric_limits<double>::infinity(), 1e12, -1.0};
  const double value = wild[dice.below(5)];
  switch (dice.below(9)) {
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
    case 7:
      start_from_spoiled_sheet(trial, dice, value);
      break;
    default:
      trial.scene.start.centre_in_world = Vector3d(0, 0, 0.001);  // inside the object
  }
}

struct Tally {
  int in_words = 0, rest = 0, refused = 0, other = 0;

  void book(const SimulateResult& result) {
    const Certificate& certificate = result.certificate;
    if (certificate.at_rest)
      ++rest;
    else if (certificate.check)
      ++refused;
    else
      ++other;
  }
  void tell(const char* what, int count) const {
    std::printf(
        "%s: %d scenes, %d refused in words, %d at rest, %d still and refused by the checker, %d "
        "not at rest\n",
        what, count, in_words, rest, refused, other);
  }
};

/// Expects either an Error or finite points; a result called at rest must be outside all objects
/// and be accepted by the checker.
void expect_honest(const Trial& trial, int index, Tally& tally) {
  try {
    const SimulateResult result =
        simulate(trial.scene, trial.fabric, trial.print, trial.measured, trial.options);
    const Certificate& certificate = result.certificate;
    tally.book(result);
    if (!certificate.at_rest)
      std::printf("trial %d %s: %s\n", index, drape::name_of(trial.options.model).data(),
                  certificate.status.c_str());
    for (const SheetMark& mark : result.sheet.marks)
      EXPECT_TRUE(mark.point_in_world.allFinite()) << "trial " << index;
    if (!certificate.at_rest) return;
    EXPECT_LT(certificate.residual.value_or(1), certificate.residual_tolerance)
        << "trial " << index;
    const Surroundings objects(trial.scene);
    for (const SheetMark& mark : result.sheet.marks)
      for (int shape = 0; shape < objects.count(); ++shape)
        EXPECT_GT(objects.gap_m(shape, mark.point_in_world), -3e-4) << "trial " << index;
    if (trial.options.model == ClothModel::triangles) {
      EXPECT_TRUE(certificate.check && certificate.check->accepted) << "trial " << index;
    }
  } catch (const Error&) {  // refused with a message
    ++tally.in_words;
  }
}

/// DRAPE_TRIALS_FROM and _TO select a part of the trials.
std::pair<int, int> range_of(int count) {
  const char* const from = std::getenv("DRAPE_TRIALS_FROM");
  const char* const to = std::getenv("DRAPE_TRIALS_TO");
  return {from != nullptr ? std::atoi(from) : 0, to != nullptr ? std::atoi(to) : count};
}

TEST(RandomScenes, HostileOnesAreRefusedOrEndFinite) {
  const auto [from, to] = range_of(test::trial_count(16, 1000));
  Tally tally;
  for (int index = from; index < to; ++index) {
    Dice dice(100000 + index);
    Trial trial = valid_trial(dice, 200);
    trial.options.drape.motion.longest_s = 0.2;
    spoil(trial, dice);
    expect_honest(trial, index, tally);
  }
  tally.tell("hostile", to - from);
  EXPECT_GT(tally.in_words, 0);
}

}  // namespace
}  // namespace drape::simulate
