// SPDX-License-Identifier: Apache-2.0
// The mesh of a drape as used by the comparison and the budget.
#include <gmock/gmock.h>

#include "compare/tables/match.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using units::mm;

constexpr double kMeshLeft_mm = 0.25;

/// Drapes at rest 5 mm above the measured sheet, with a mesh error of kMeshLeft_mm; from the
/// measured shape 1 mm; on the paper's grid 7 mm.
DrapeInput drape_on_a_mesh() {
  Sheet from_measured = test::mesh_sheet(2.5 * mm, 5, test::raised(1 * mm));
  std::get<SimulatedSource>(from_measured.source).from_measured = true;
  DrapeInput input = test::drape_of(
      test::measured_sheet(), {test::simulated_sheet(31, 5, test::raised(7 * mm)), from_measured,
                               test::mesh_sheet(2.5 * mm, 5, test::raised(5 * mm)),
                               test::mesh_sheet(2.5 * mm, 1, test::raised(6 * mm)),
                               test::mesh_sheet(5 * mm, 5, test::raised(4 * mm))});
  input.simulations[2].levels = test::levels_of(input.measured.sheet, kMeshLeft_mm * mm);
  tell_apart(input.simulations);
  return input;
}

TEST(Levels, TheScenesOwnStartOnTheFinestMeshSpeaksForTheDrape) {
  const DrapeInput input = drape_on_a_mesh();
  const Report report = compare_drape(input, {});
  ASSERT_TRUE(report.headline);
  EXPECT_EQ(report.real_virtual[*report.headline].simulation, 2U);
  EXPECT_NEAR(report.real_virtual[*report.headline].statistics.mean_m / mm, 5, 1e-9);
  EXPECT_EQ(input.simulations[4].discretisation(), "5 mm");
  EXPECT_THAT(input.simulations[1].label(), HasSubstr("2.5 mm, 5 segments, from measured shape"));
  EXPECT_TRUE(report.virtual_virtual.empty()) << "the paper's pairs are of grids";
  EXPECT_EQ(
      mesh_sentence(input, report),
      "mesh error up to 0.250 mm in the mean of the marks; `--spacing-mm 1.25` lowers it; U takes "
      "what of it lies along the distances");
  EXPECT_THAT(text_of(real_virtual_table(input, report)), HasSubstr("2.5 mm"));
}

TEST(Levels, AreInTheBudgetAlongTheWayFromTheCoarserMeshElseTheDistance) {
  DrapeInput input = drape_on_a_mesh();
  const BudgetInputs inputs = budget_inputs_of(input, compare_drape(input, {}), {});
  const auto of = [&](const std::string& what) {
    return *std::find_if(inputs.effects.begin(), inputs.effects.end(),
                         [&](const InputEffect& effect) { return effect.what == what; });
  };
  EXPECT_TRUE(of("mesh").rectangular);
  EXPECT_NEAR(of("mesh").up_m(60, 2) / mm, kMeshLeft_mm, 1e-9);
  EXPECT_NEAR(of("mesh").down_m(60, 2) / mm, -kMeshLeft_mm, 1e-9);
  EXPECT_NEAR(*of("mesh").own_m / mm, kMeshLeft_mm, 1e-9);

  input.simulations[2].levels->marks[60].from_coarser_m = Eigen::Vector3d(0, -3 * mm, 0);
  const BudgetInputs along = budget_inputs_of(input, compare_drape(input, {}), {});
  for (const InputEffect& effect : along.effects)
    if (effect.what == "mesh") {
      EXPECT_NEAR(effect.up_m(60, 1) / mm, -kMeshLeft_mm, 1e-9);
      EXPECT_NEAR(effect.up_m(60, 2), 0, 1e-12);
    }

  const std::string unknown = "the mesh error, which its sheet does not state";
  EXPECT_THAT(inputs.missing, testing::Not(Contains(unknown)));
  input.simulations[2].levels->left_m.reset();
  EXPECT_THAT(budget_inputs_of(input, compare_drape(input, {}), {}).missing, Contains(unknown));
  input.simulations.resize(1);  // the paper's grid
  const Report paper = compare_drape(input, {});
  EXPECT_THAT(budget_inputs_of(input, paper, {}).missing, Contains(unknown));
  EXPECT_THAT(mesh_sentence(input, paper), HasSubstr("without --paper"));
}

TEST(Levels, OfAMeshThatIsNotAtRestOrAloneSayWhyNothingIsKnown) {
  LevelsFile levels = test::levels_of(test::measured_sheet(), kMeshLeft_mm * mm);
  levels.left_m.reset();
  levels.levels.back().at_rest = false;
  levels.levels.back().status = "stagnates";
  EXPECT_EQ(mesh_error_sentence(levels),
            "mesh error not known: the mesh of 2.5 mm is not at rest (stagnates)");
  levels.levels.pop_back();
  EXPECT_EQ(mesh_error_sentence(levels),
            "mesh error not known: one mesh alone; `--spacing-mm 5` adds a finer one");
}

TEST(Levels, ThatEndOnAnotherBranchSaySo) {
  LevelsFile levels = test::levels_of(test::measured_sheet(), kMeshLeft_mm * mm);
  for (const double part : {1.0, 0.1}) {
    for (LevelMark& mark : levels.marks)
      mark.from_coarser_m = part * *levels.levels.back().from_coarser_m * Eigen::Vector3d::UnitX();
    EXPECT_EQ(mesh_error_sentence(levels),
              part == 1 ? "mesh error up to 0.250 mm in the mean of the marks; `--spacing-mm 1.25` "
                          "lowers it"
                        : "mesh error up to 0.250 mm in the mean of the marks, on a branch that "
                          "lies 0.750 mm from that of the next coarser mesh; `--spacing-mm 1.25` "
                          "shows whether it stays there");
  }
}

TEST(Levels, AreThoseOfTheSheetBesideThem) {
  const drape::test::TemporaryFolder folder;
  const fs::path sheet = folder.path() / "2.5mm-5" / "sheet.ply",
                 file = sheet.parent_path() / "levels.json";
  write_sheet(folder.path() / "sheet.ply", test::measured_sheet());
  write_sheet(sheet, test::mesh_sheet(2.5 * mm, 5));
  LevelsFile levels = test::levels_of(test::measured_sheet(), kMeshLeft_mm * mm);
  levels.sheet_sha256 = sha256_of_file(sheet.parent_path() / "sheet.json");
  write_record(file, levels);
  const Session session = read_session({folder.path() / "sheet.ply", sheet}, {});
  const auto& read = session.drapes.at(0).input.simulations.at(0).levels;
  ASSERT_TRUE(read);
  EXPECT_NEAR(*read->left_m / mm, kMeshLeft_mm, 1e-12);
  EXPECT_EQ(read->marks.size(), 121U);
  EXPECT_EQ(read->levels.back().points, 9000);
  EXPECT_THAT(session.read, Contains(testing::Pair(file, sha256_of_file(file))));
  levels.sheet_sha256 = std::string(64, 'b');
  write_record(file, levels);
  EXPECT_THROW((void)read_session({folder.path() / "sheet.ply", sheet}, {}), Error);
}

}  // namespace
}  // namespace drape::compare
