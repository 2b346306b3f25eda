// SPDX-License-Identifier: Apache-2.0
// What a sheet must not pass through on the straight paths of its steps, or begin in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <variant>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/contact/piercing.hpp"
#include "simulate/equilibrium/run.hpp"
#include "simulate/simulate.hpp"
#include "simulate/start/start_check.hpp"
#include "simulate/test_drape.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using units::mm;

Box plate(double thick_m) {
  Box box;
  box.size_m = {0.128, 0.128, thick_m};
  box.edge_radius_m = 0.4 * thick_m;
  box.world_from_box.translation_m = {-0.003, 0.005, 0.1 - 0.5 * thick_m};
  return box;
}

/// All 1 mm thick, with the upper face at z = 0.1 m.
std::vector<Obstacle> thin_solids(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "plate.obj";
  write_durable(file,
                "v -64 -64 -1\nv 64 -64 -1\nv 64 64 -1\nv -64 64 -1\n"
                "v -64 -64 0\nv 64 -64 0\nv 64 64 0\nv -64 64 0\n"
                "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  Cylinder disc;
  disc.radius_m = 0.064;
  disc.height_m = 1 * mm;
  disc.edge_radius_m = 0.4 * mm;
  disc.world_from_cylinder.translation_m = {-0.003, 0.005, 0.1 - 0.5 * mm};
  MeshObject mesh{file, {}};
  mesh.world_from_mesh.translation_m = {-0.003, 0.005, 0.1};
  return {plate(1 * mm), disc, mesh};
}

Scene scene_over(const Obstacle& obstacle) {
  Scene scene = read_scene(test::source_root() / "rigs/bench1/scenes/A.toml");
  scene.obstacles = {obstacle};
  scene.table_z_m = 0;
  scene.start = {StartMode::flat, 0, Vector3d(0.002, 0.001, 0.103), 0.14};
  return scene;
}

SimulateResult drape_over(const Scene& scene, int grid, long most_steps = 2000) {
  SimulateOptions options = options_of(grid, Solver::newton);
  options.max_steps = most_steps;
  return drape_of(scene, options);
}

TEST(Surroundings, SaysWhereAStraightPathEntersAShape) {
  Surroundings objects;
  objects.add(Sphere{Vector3d(0, 0, 0), 0.045});
  objects.add(plate(1 * mm));
  constexpr double kDeep = 1e-6;
  for (const double height : {0.0, 0.02, 0.0449}) {
    const auto fraction =
        objects.first_entry(0, Vector3d(-0.1, height, 0), Vector3d(0.1, height, 0), kDeep);
    const double inner = 0.045 - kDeep;
    ASSERT_TRUE(fraction.has_value()) << height;
    EXPECT_NEAR(-0.1 + 0.2 * *fraction, -std::sqrt(inner * inner - height * height), 1e-12);
  }
  EXPECT_FALSE(objects.first_entry(0, Vector3d(-0.1, 0.0451, 0), Vector3d(0.1, 0.0451, 0), kDeep));
  EXPECT_FALSE(objects.first_entry(0, Vector3d(0.05, 0, 0), Vector3d(0.1, 0, 0), kDeep));
  const auto through = objects.first_entry(1, Vector3d(0, 0, 0.11), Vector3d(0, 0, 0.09), kDeep);
  ASSERT_TRUE(through.has_value());
  EXPECT_NEAR(*through, 0.5, 1e-4);
  const auto from_face = objects.first_entry(1, Vector3d(0, 0, 0.1), Vector3d(0, 0, 0.09), kDeep);
  ASSERT_TRUE(from_face.has_value());
  EXPECT_NEAR(*from_face, 1e-4, 1e-6);
  // A place that is no number, or a displacement that is far too long, ends too.
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(objects.first_entry(1, Vector3d(0, 0, 0.11), Vector3d(0, nan, 0.09), kDeep));
  EXPECT_FALSE(objects.first_entry(1, Vector3d(0, 0, 0.11), Vector3d(0, 0, 1e12), kDeep));
}

TEST(StaticSolver, ABodyThinnerThanAStepHoldsTheSheet) {
  const test::TemporaryFolder folder;
  for (const Obstacle& solid : thin_solids(folder.path())) {
    // On sharp edges this solver finds no rest, and says so.
    const bool sharp = std::holds_alternative<MeshObject>(solid);
    for (const int grid : {11, 21}) {
      const SimulateResult result = drape_over(scene_over(solid), grid, sharp ? 200 : 2000);
      const bool rests = result.report.status == RestStatus::at_rest;
      const bool pierced = result.report.pierced_m > result.report.penetration_tolerance_m;
      // At 21x21 a corner of the plate stands through the sheet, which must not be called at rest.
      EXPECT_FALSE(rests && pierced) << solid.index() << ", " << grid;
      if (!sharp) {
        EXPECT_NE(rests, pierced) << result.report.sentence;
      }
      int above = 0;
      for (const SheetMark& mark : result.sheet.marks) {
        const Vector3d p = mark.point_in_world - Vector3d(-0.003, 0.005, 0);
        if (p.head<2>().norm() > 60 * mm) continue;
        EXPECT_GT(p.z(), 0.1 - 1e-6) << solid.index() << ", " << grid;
        ++above;
      }
      EXPECT_GT(above, grid * grid / 8) << solid.index() << ", " << grid;
    }
  }
}

TEST(StaticSolver, AStartInsideAnObjectIsSaid) {
  Scene scene = scene_over(plate(10 * mm));
  scene.start.centre_in_world->z() = 0.0995;
  EXPECT_THAT(drape_over(scene, 11).report.warnings, Contains(HasSubstr("started inside")));
  scene.start.centre_in_world->z() = 0.101;
  EXPECT_THAT(drape_over(scene, 11).report.warnings, Not(Contains(HasSubstr("started inside"))));
}

TEST(StaticSolver, AStartThatCouldComeOutBelowAnObjectIsRefused) {
  const auto refused = [](const Scene& scene, bool round) -> std::string {
    const GridSpec grid{11, 11, {0.2, 0.2}, round};
    try {
      refuse_flat_start_inside(scene, grid, Surroundings(scene));
    } catch (const Error& error) {
      EXPECT_EQ(error.where().field, "start.centre_mm");
      return error.what_to_do();
    }
    return "";
  };
  Scene scene = scene_over(Sphere{Vector3d(0, 0, 0.05), 0.05});
  scene.start.mode = StartMode::flat;
  scene.table_z_m = 0;
  for (const double z_m : {0.0999, 0.1, 0.2}) {  // laid on it, touching, above
    scene.start.centre_in_world = Vector3d(0, 0, z_m);
    EXPECT_EQ(refused(scene, false), "") << z_m;
  }
  scene.start.centre_in_world = Vector3d(0, 0, 0.1e-3);  // metres for millimetres
  EXPECT_THAT(refused(scene, false), HasSubstr("must be some"));
  scene.start.centre_in_world = Vector3d(0, 0, 0.06);
  EXPECT_THAT(refused(scene, false), HasSubstr("some 40 mm more"));
  scene.obstacles.clear();
  scene.start.centre_in_world = Vector3d(0, 0, -0.02);  // below the table
  EXPECT_THAT(refused(scene, false), HasSubstr("some 20 mm more"));
  // A post beside a round specimen, where a square one has its corner.
  scene.obstacles = {
      Box{{Eigen::Matrix3d::Identity(), Vector3d(0.09, 0.09, 0.05)}, Vector3d(0.01, 0.01, 0.1), 0}};
  scene.start.centre_in_world = Vector3d(0, 0, 0.05);
  EXPECT_EQ(refused(scene, true), "");
  EXPECT_THAT(refused(scene, false), HasSubstr("some 50 mm more"));
}

TEST(Piercing, MeasuresHowFarARimStandsThroughTheSheet) {
  const GridSpec grid{21, 21, {0.2, 0.2}};
  Surroundings objects;
  objects.add(plate(1 * mm));
  const Vector3d corner(-0.067, -0.059, 0.0);  // corner of the plate, seen from above
  const auto upright = [&](double x) {
    Field sheet(3 * static_cast<std::size_t>(grid.count()));
    for (int i = 0; i < grid.count(); ++i) {
      const int row = i / grid.cols, col = i % grid.cols;
      sheet[i] = corner.x() + x;
      sheet[grid.count() + i] = -0.097 + 0.01 * row;
      sheet[2 * grid.count() + i] = 0.0043 + 0.01 * col;
    }
    return sheet;
  };
  EXPECT_EQ(rim_through_m(grid, upright(-0.001), objects), 0);
  for (const double far : {0.002, 0.0071}) {
    EXPECT_NEAR(rim_through_m(grid, upright(far), objects), far, 0.02 * far);
  }
  EXPECT_NEAR(rim_through_m(grid, upright(0.05), objects), 0.01, 1e-12) << "one spacing at most";
  Surroundings cube;  // a line round an edge is not through it
  Box block = plate(64 * mm);
  block.edge_radius_m = 1 * mm;
  cube.add(block);
  Field tilted = upright(0.002);
  for (int i = 0; i < grid.count(); ++i) tilted[i] += 0.5 * (tilted[2 * grid.count() + i] - 0.098);
  EXPECT_EQ(rim_through_m(grid, tilted, cube), 0);
}

TEST(StartCheck, TellsOfASheetThroughItselfAndOfAnEdgeThroughIt) {
  const GridSpec grid{21, 21, {0.2, 0.2}};
  const auto sheet = [&](double fold) {
    Field x(3 * static_cast<std::size_t>(grid.count()));
    for (int i = 0; i < grid.count(); ++i) {
      const int row = i / grid.cols, col = i % grid.cols;
      const double u = 0.01 * row, v = 0.01 * col;
      x[i] = u < 0.1 ? u : u - fold * 2.03 * (u - 0.1);
      x[grid.count() + i] = v;
      x[2 * grid.count() + i] = fold * (u < 0.1 ? 0 : 0.0521 - 0.7 * (u - 0.1));
    }
    return x;
  };
  Surroundings free, spiked;
  Box upright = plate(1 * mm);
  upright.edge_radius_m = 0;
  upright.size_m = {0.05, 0.0007, 0.1};
  upright.world_from_box.translation_m = {0.1013, 0.1043, 0.02};
  spiked.add(upright);
  EXPECT_TRUE(faults_of_start(grid, sheet(0), free).empty());
  EXPECT_THAT(faults_of_start(grid, sheet(1), free), Contains(HasSubstr("through itself")));
  EXPECT_THAT(faults_of_start(grid, sheet(0), spiked), Contains(HasSubstr("pierced")));
}

}  // namespace
}  // namespace drape::simulate
