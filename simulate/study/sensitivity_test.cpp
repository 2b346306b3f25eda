// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/sensitivity.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "core/units.hpp"
#include "simulate/study/split.hpp"
#include "simulate/test_drape.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

/// The flat start as a sheet: something to measure a distance from.
Sheet flat_reference(const Print& print, double z_m) {
  Sheet sheet;
  sheet.rows = sheet.cols = 5;
  sheet.patch_m = print.patch_m;
  for (int k = 0; k < 25; ++k) {
    SheetMark mark;
    mark.mark = {k / 5, k % 5};
    mark.material_m =
        Eigen::Vector2d(int{k / 5} * 0.25, (k % 5) * 0.25).cwiseProduct(print.patch_m);
    mark.point_in_world = Vector3d(mark.material_m.y() - 0.1, 0.1 - mark.material_m.x(), z_m);
    sheet.marks.push_back(mark);
  }
  return sheet;
}

/// A sheet at rest whose laws can be changed while contacts and friction stay as they are.
struct Rested {
  Scene scene;
  Print print;
  Surroundings surroundings;
  GridSpec grid;
  ClothLaws laws;
  Cloth cloth;
  StaticSolver solver;
  StaticReport report;

  Rested(const Scene& the_scene, int side)
      : scene(the_scene),
        print(read_print(scene.print_file)),
        surroundings(scene),
        grid{side, side, print.patch_m},
        laws(laws_of(scene)),
        cloth(grid, laws, MassRule::area),
        solver(cloth, surroundings, options_of(scene)) {
    const StartState start =
        make_start(scene, print, grid, std::nullopt, surroundings.top_z_m(), 1e-6);
    solver.contacts().hold(start.holds, start.hold_in_world);
    solver.position = start.position;
    report = solver.solve();
  }
  static ClothLaws laws_of(const Scene& scene) {
    SimulateReport ignored;
    return make_laws(read_fabric(scene.fabric_file), 1, ignored);
  }
  static StaticOptions options_of(const Scene& scene) {
    StaticOptions how;
    how.friction = scene.friction;
    how.residual_tolerance = 1e-7;
    return how;
  }
};

/// Moves a rested sheet to where one value is changed, the points between its particles that touch
/// kept; the displacement, x, y, z of each particle.
Eigen::VectorXd displacement_with(const Scene& scene, int side, FabricValue value, double factor) {
  Rested rested(scene, side);
  const Field before = rested.solver.position;
  rested.solver.contacts().keep_points();
  rested.cloth = Cloth(rested.grid, scaled(rested.laws, value, factor), MassRule::area);
  EXPECT_EQ(rested.solver.solve().status, StaticStatus::at_rest) << name_of(value);
  const auto n = static_cast<std::size_t>(rested.grid.count());
  Eigen::VectorXd displacement(static_cast<Eigen::Index>(3 * n));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      displacement[static_cast<Eigen::Index>(3 * i + a)] =
          rested.solver.position[a * n + i] - before[a * n + i];
    }
  }
  return displacement;
}

/// Departure of the first-order displacements from central differences, over the size of the
/// differences: the worst value's, and that of all values together.
struct Departure {
  double worst = 0, together = 0;
};

Departure departure_from_differences(const Scene& scene, int side, double change,
                                     const std::vector<FabricValue>& values) {
  Rested rested(scene, side);
  EXPECT_EQ(rested.report.status, StaticStatus::at_rest);
  const Reference reference =
      reference_on(rested.grid, flat_reference(rested.print, rested.surroundings.top_z_m() + 0.1));
  const auto list =
      find_sensitivities(rested.cloth, rested.solver, scene.gravity_m_per_s2, reference);
  if (!list) {
    ADD_FAILURE() << "the equilibrium is a saddle";
    return {1, 1};
  }
  Departure departure;
  double errors = 0, sizes = 0;
  for (const FabricValue value : values) {
    const Eigen::VectorXd difference = (displacement_with(scene, side, value, 1 + change) -
                                        displacement_with(scene, side, value, 1 - change)) /
                                       (2 * change);
    const Sensitivity& found = (*list)[static_cast<std::size_t>(value)];
    EXPECT_EQ(found.value, value);
    const double error = (found.displacement - difference).norm() / difference.norm();
    ::testing::Test::RecordProperty("error_of_" + name_of(value), std::to_string(error));
    departure.worst = std::max(departure.worst, error);
    errors += (found.displacement - difference).squaredNorm();
    sizes += difference.squaredNorm();
  }
  departure.together = std::sqrt(errors / sizes);
  return departure;
}

TEST(Sensitivity, OfAHangingSheetIsThatOfCentralDifferences) {
  EXPECT_LT(departure_from_differences(hanging_scene(), 9, 1e-3,
                                       {std::begin(kFabricValues), std::end(kFabricValues)})
                .worst,
            1e-3);
}

// With friction that lets little slide. What slides all the same has no derivative, and which
// places do depends on rounding; nor has a drape that does not rest, of those that stick so well.
TEST(Sensitivity, OfASheetThatSticksToACubeIsNearCentralDifferencesAtMostFrictions) {
  std::vector<double> together;
  for (const double friction : {4, 5, 6, 8, 10, 12, 15, 20, 50}) {
    Scene scene = lying_scene("C");
    scene.friction = friction;
    if (Rested(scene, 9).report.status != StaticStatus::at_rest) continue;
    together.push_back(departure_from_differences(scene, 9, 1e-4,
                                                  {FabricValue::shear, FabricValue::bending_warp,
                                                   FabricValue::areal_density})
                           .together);
  }
  ASSERT_GT(together.size(), 5U);
  std::ranges::sort(together);
  EXPECT_LT(together[together.size() / 2], 0.01) << "the median";
}

TEST(Sensitivity, AllStiffnessesAndTheWeightTogetherMoveNothing) {
  Rested rested(hanging_scene(), 9);
  const Reference reference = reference_on(rested.grid, flat_reference(rested.print, 0.3));
  const auto list =
      find_sensitivities(rested.cloth, rested.solver, rested.scene.gravity_m_per_s2, reference);
  ASSERT_TRUE(list.has_value());
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(3 * rested.grid.count());
  double largest = 0;
  for (const Sensitivity& one : *list) {
    sum += one.displacement;
    largest = std::max(largest, one.displacement.norm());
  }
  EXPECT_LT(sum.norm(), 1e-4 * largest);
}

TEST(ErrorSplit, TabulatesEveryVariantOnceFromTheBaseAndOnceFromTheStart) {
  const Scene scene = lying_scene("C");
  const Print print = read_print(scene.print_file);
  SimulateOptions options;
  options.rows = options.cols = 9;
  options.segments = 1;
  options.solver = Solver::newton;
  const ErrorSplit split = split_error(scene, read_fabric(scene.fabric_file), print, std::nullopt,
                                       flat_reference(print, 0.15), options, {.starts = 2});
  ASSERT_EQ(split.rows.size(), 1U + 2 * 9 + 2);
  EXPECT_TRUE(split.sensitivities.has_value());
  EXPECT_EQ(split.rows.front().change_m, 0);
  for (const SplitRow& row : split.rows) {
    EXPECT_TRUE(std::isfinite(row.distance_m)) << row.what;
    EXPECT_TRUE(row.at_rest) << row.what << (row.continued ? " from the base" : "");
  }
  EXPECT_GT(split.rows[1].moved_m, 0.01 * mm);  // mass rule
  EXPECT_LE(split.rows.back().distance_m, split.rows[split.rows.size() - 2].distance_m);
}

TEST(ErrorSplit, SaysWhereTheMarksGoWhenAValueErrs) {
  Scene scene = lying_scene("C");
  scene.stand_ins = {"friction"};
  scene.friction_uncertainty.reset();
  const Print print = read_print(scene.print_file);
  Fabric fabric = read_fabric(scene.fabric_file);
  fabric.stand_ins = {"shear curves"};
  fabric.bias_bending_n_m = 1e-6;
  SimulateOptions options;
  options.rows = options.cols = 9;
  options.segments = 1;
  options.solver = Solver::newton;
  const ErrorSplit split =
      split_error(scene, fabric, print, std::nullopt, flat_reference(print, 0.15), options,
                  {.starts = 1, .only_first_order = true, .scene_values = true});
  ASSERT_TRUE(split.sensitivities);
  const auto rows = static_cast<Eigen::Index>(split.marks.size());
  for (const Sensitivity& one : *split.sensitivities) {
    ASSERT_TRUE(one.moves) << name_of(one.value);
    EXPECT_EQ(one.moves->up_m.rows(), rows);
    const bool stand_in = one.value == FabricValue::shear;
    EXPECT_EQ(one.moves->half_width.has_value(), stand_in) << name_of(one.value);
    EXPECT_EQ(one.moves->step, stand_in ? 50 : 1);
    EXPECT_EQ(one.moves->down_m == -one.moves->up_m, !stand_in) << name_of(one.value);
  }
  ASSERT_EQ(split.scene.size(), 6U);  // x, y, z, size, friction, internal friction
  ASSERT_TRUE(split.scene[2].change_per_unit);
  // Cloth that lies on a cube goes up and down with it: the middle one of 5 x 5 marks.
  ASSERT_EQ(rows, 25);
  const double up_m = split.scene[2].moves.step * mm;
  EXPECT_NEAR(split.scene[2].moves.up_m(12, 2), up_m, 0.1 * up_m);
  EXPECT_NEAR(split.scene[2].moves.down_m(12, 2), -up_m, 0.1 * up_m);
  EXPECT_EQ(split.scene[4].moves.half_width, kStandInPart * scene.friction);
  EXPECT_EQ(split.scene[5].value, "internal_friction");
}

}  // namespace
}  // namespace drape::simulate
