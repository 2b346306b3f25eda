// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/study.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using units::mm;

std::filesystem::path rig() {
  return test::source_root() / "rigs/paper";
}

SimulateResult drape_paper(const std::string& name, int segments) {
  const Scene scene = read_scene(rig() / "scenes" / (name + ".toml"));
  SimulateOptions options;
  options.segments = segments;
  options.drape.spacing_m = 10 * mm;
  return simulate(scene, read_fabric(scene.fabric_file), read_print(scene.print_file), std::nullopt,
                  options);
}

Sheet mirrored(Sheet sheet, double y_m) {
  for (SheetMark& mark : sheet.marks) mark.point_in_world.y() = 2 * y_m - mark.point_in_world.y();
  return sheet;
}

TEST(PaperD, TwoStartsLeadToTwoRestsThatAreNearlyMirrorImages) {
  // Paper, Figs. 10 and 11: one cloth, two pins, two rest shapes.
  const SimulateResult flat = drape_paper("D", 1), above = drape_paper("D_above", 1),
                       turned = drape_paper("D_turned", 1);
  for (const SimulateResult* result : {&flat, &above, &turned})
    EXPECT_TRUE(result->at_rest()) << result->certificate.status;
  EXPECT_LT(*mean_distance_m(flat.sheet, above.sheet, flat.sheet), 1 * mm);
  EXPECT_GT(*mean_distance_m(flat.sheet, turned.sheet, flat.sheet), 30 * mm);
  // The pins are at y = 100 mm; the side on which the belly hangs hardly affects the energy.
  EXPECT_LT(*mean_distance_m(flat.sheet, mirrored(turned.sheet, 0.1), flat.sheet), 10 * mm);
  EXPECT_NEAR(turned.certificate.energies->end_j, flat.certificate.energies->end_j,
              0.01 * flat.certificate.energies->end_j);
}

TEST(RigStudy, PutsTheClothBesideThePapersGrids) {
  const test::TemporaryFolder folder;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
  PlanChoice choice;
  choice.scenes = {"D"};
  choice.grids = {5};
  choice.segments = {1};
  choice.spacings_m = {20 * mm};
  const StudyPlan plan = read_plan(rig(), choice, folder.path(), program);
  ASSERT_EQ(plan.cases.size(), 2U);
  EXPECT_TRUE(plan.by_name);
  EXPECT_EQ(plan.cases[0].folder, folder.path() / "D/paper/5x5-1");
  EXPECT_EQ(plan.cases[1].folder, folder.path() / "D/triangles/20mm-1");
  const std::vector<StudyOutcome> first = run_part(plan, {}, folder.path(), 2);
  for (const StudyOutcome& outcome : first) {
    EXPECT_FALSE(outcome.kept);
    EXPECT_TRUE(outcome.at_rest) << outcome.status;
  }
  const std::string csv = study_csv(first);
  EXPECT_THAT(csv, testing::HasSubstr(",D,A,paper,5x5,1,0,done,1,"));
  EXPECT_THAT(csv, testing::HasSubstr(",D,A,triangles,20 mm,1,0,done,1,"));
  const std::string tables = study_tables(first, rig() / "published.csv");
  EXPECT_THAT(tables, testing::HasSubstr("| D | - (4.6) |"));
  EXPECT_THAT(tables, testing::ContainsRegex("\\| D \\| 1 \\| [0-9]+\\.[0-9]+ \\|"));
  EXPECT_EQ(study_csv(run_part(plan, {}, folder.path())), csv);
}

TEST(RigStudy, NamesWhatIsWrong) {
  const auto refusal = [](const std::filesystem::path& of, const PlanChoice& choice) {
    try {
      return fmt::format("{} cases", read_plan(of, choice, "out", "/proc/self/exe").cases.size());
    } catch (const Error& error) {
      return std::string(error.what());
    }
  };
  const std::filesystem::path physics = test::source_root() / "rigs/physics";
  PlanChoice choice;
  choice.scenes = {"Z"};
  EXPECT_THAT(refusal(rig(), choice), testing::HasSubstr("no scene `Z`"));
  choice = {};
  choice.grids = {11};
  EXPECT_THAT(refusal(physics, choice), testing::HasSubstr("--spacings-mm"));
  EXPECT_THAT(refusal(test::source_root() / "docs", {}), testing::HasSubstr("no plan.toml"));
}

TEST(MeanDistance, IsTakenAtThePointsOfTheThirdSheet) {
  const auto flat = [](int side, double z_m) {
    Sheet sheet;
    sheet.rows = sheet.cols = side;
    sheet.patch_m = {0.2, 0.2};
    for (int k = 0; k < side * side; ++k) {
      const Eigen::Vector2d at(0.2 * (k / side) / (side - 1), 0.2 * (k % side) / (side - 1));
      sheet.marks.push_back({{k / side, k % side}, at, {at.x(), at.y(), z_m}, {}, {}, {}});
    }
    return sheet;
  };
  const Sheet plane = flat(21, 0), coarsest = flat(11, 0);
  EXPECT_NEAR(*mean_distance_m(coarsest, flat(31, 0.003), coarsest), 0.003, 1e-15);
  EXPECT_NEAR(*mean_distance_m(plane, flat(15, 0.001), coarsest), 0.001, 1e-15);
  // A tent between two marks of the coarsest grid: all of it, or only what the grid resolves.
  Sheet tent = plane;
  tent.marks[21 * 7 + 4].point_in_world.z() = 0.01;
  EXPECT_NEAR(*mean_distance_m(plane, tent, plane), 0.01 / 441, 1e-15);
  EXPECT_NEAR(*mean_distance_m(plane, tent, coarsest), 0, 1e-15);
  tent.marks[21 * 8 + 4].point_in_world.z() = 0.01;
  EXPECT_NEAR(*mean_distance_m(plane, tent, coarsest), 0.01 / 121, 1e-15);
  Sheet holed = coarsest;
  holed.marks.erase(holed.marks.begin());
  EXPECT_FALSE(mean_distance_m(plane, holed, coarsest).has_value());
}

}  // namespace
}  // namespace drape::simulate
