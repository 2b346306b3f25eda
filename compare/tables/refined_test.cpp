// SPDX-License-Identifier: Apache-2.0
// A drape that was carried over to a finer grid, as the comparison and the budget take it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "compare/tables/budget.hpp"
#include "compare/tables/tables.hpp"
#include "compare/test_sheets.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;
using units::mm;

constexpr double kMayBe_mm = 0.25;
constexpr const char* kSentence = "0.250 mm may be left to a grid without end";

test::Shape lifted(double by_m) {
  return
      [by_m](const Eigen::Vector2d& m) -> Vector3d { return test::flat(m) + Vector3d(0, 0, by_m); };
}

/// Falls 5 mm (five segments) and 6 mm (one) above the measured sheet, another grid 7 mm, and the
/// first one refined, 4 mm above it; its grid may leave kMayBe_mm more.
DrapeInput refined_drape() {
  DrapeInput input = test::drape_of(
      test::measured_sheet(),
      {test::simulated_sheet(31, 5, lifted(5 * mm)), test::simulated_sheet(31, 1, lifted(6 * mm)),
       test::simulated_sheet(21, 5, lifted(7 * mm)), test::simulated_sheet(61, 5, lifted(4 * mm))});
  RefinementFile refined;
  refined.rest_sha256 = input.simulations[0].sheet.sha256;
  refined.left_m = kMayBe_mm * mm;
  refined.sentence = kSentence;
  for (const SheetMark& mark : input.measured.sheet.marks)
    refined.marks.push_back(
        {mark.mark, mark.point_in_world + Vector3d(0, 0, 4 * mm), Vector3d(0, 0, -kMayBe_mm * mm)});
  input.simulations[3].refined = refined;
  return input;
}

const InputEffect& effect_of(const BudgetInputs& inputs, const std::string& what) {
  return *std::find_if(inputs.effects.begin(), inputs.effects.end(),
                       [&](const InputEffect& effect) { return effect.what == what; });
}

TEST(Refined, SpeaksForTheDrapeAndStatesWhatItsGridLeaves) {
  const DrapeInput input = refined_drape();
  const Report report = compare_drape(input, {});
  ASSERT_TRUE(report.headline);
  const RealVirtual& headline = report.real_virtual[*report.headline];
  EXPECT_EQ(input.simulations[headline.simulation].label(), "61x61 refined, 5 segments");
  EXPECT_NEAR(headline.statistics.mean_m / mm, 4, 1e-9);
  const auto error = grid_error_of(input, report);
  ASSERT_TRUE(error && error->left_m);
  EXPECT_NEAR(*error->left_m / mm, kMayBe_mm, 1e-12);
  EXPECT_EQ(grid_sentence(*error), kSentence);
  EXPECT_THAT(text_of(real_virtual_table(input, report)), HasSubstr("61x61, refined"));
}

TEST(Refined, IsNoPairOfTheTablesAndNoGridOfAFall) {
  DrapeInput input = refined_drape();
  const auto pairs = compare_drape(input, {}).virtual_virtual.size();
  input.simulations.pop_back();
  const Report falls = compare_drape(input, {});
  EXPECT_EQ(falls.virtual_virtual.size(), pairs);
  EXPECT_EQ(grid_error_of(input, falls)->coarser, "21x21, 5 segments");
}

// The fall that it began with shows the effect of another number of segments.
TEST(Refined, IsInTheBudgetByWhatItsGridLeavesAndByItsFall) {
  DrapeInput input = refined_drape();
  const BudgetInputs inputs = budget_inputs_of(input, compare_drape(input, {}), {});
  const InputEffect& grid = effect_of(inputs, "grid");
  EXPECT_TRUE(grid.rectangular);
  EXPECT_NEAR(grid.up_m(60, 2) / mm, -kMayBe_mm, 1e-9);
  EXPECT_NEAR(grid.down_m(60, 2) / mm, kMayBe_mm, 1e-9);
  EXPECT_NEAR(effect_of(inputs, "segments per curve").up_m(60, 2) / mm, 1, 1e-9);
  input.simulations.erase(input.simulations.begin());
  const BudgetInputs alone = budget_inputs_of(input, compare_drape(input, {}), {});
  EXPECT_THAT(alone.missing, testing::Contains("segments per curve: simulate two"));
}

TEST(Refined, IsWhatItsListSaysAsLongAsTheSheetIsTheSame) {
  const drape::test::TemporaryFolder folder;
  const auto sheet = folder.path() / "61x61" / "sheet.ply";
  write_sheet(sheet, test::simulated_sheet(61, 5, lifted(4 * mm)));
  EXPECT_FALSE(refined_of(sheet));
  RefinementFile list;
  list.rest_sha256 = "ab";
  list.goal_m = 0.5 * mm;
  list.used = 0;
  list.left_m = kMayBe_mm * mm;
  list.sentence = kSentence;
  list.grids = {{61,
                 61,
                 "61x61/sheet.ply",
                 sha256_of_file(folder.path() / "61x61" / "sheet.json"),
                 true,
                 "at rest",
                 9,
                 {}}};
  list.marks = {{{1, 2}, Vector3d(1, 2, 3) * mm, Vector3d(0, 0, kMayBe_mm) * mm}};
  write_record(folder.path() / "refinement.json", list);
  const auto found = refined_of(sheet);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->rest_sha256, "ab");
  EXPECT_FALSE(found->order);
  EXPECT_NEAR(*found->left_m / mm, kMayBe_mm, 1e-12);
  ASSERT_EQ(found->marks.size(), 1U);
  EXPECT_NEAR(found->marks[0].left_m.z() / mm, kMayBe_mm, 1e-12);
  list.used.reset();
  write_record(folder.path() / "refinement.json", list);
  EXPECT_FALSE(refined_of(sheet)->left_m);
  write_sheet(sheet, test::simulated_sheet(61, 5, lifted(3 * mm)));
  EXPECT_FALSE(refined_of(sheet));
}

}  // namespace
}  // namespace drape::compare
