// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>

#include "compare/history/results.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using units::deg;
using units::mm;

constexpr double kFlatPatch_m = 220 * mm;
const Eigen::Vector2d kAxis(30 * mm, -20 * mm);

/// Folds that differ in every direction, so that only one rotation maps the shape to itself.
Eigen::Vector3d folded(const Eigen::Vector2d& m) {
  const Eigen::Vector3d p = test::flat(m);
  return {p.x(), p.y(), 20 * mm * std::sin(p.x() / (40 * mm)) + 0.3 * p.y() * p.x() / kFlatPatch_m};
}

test::Shape turned(const test::Shape& shape, double angle_rad) {
  return [=](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    const Eigen::Vector3d axis(kAxis.x(), kAxis.y(), 0);
    return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()) * (shape(m) - axis) + axis;
  };
}

/// Particles exactly at the marks.
Sheet as_simulated(const test::Shape& shape) {
  Sheet sheet = test::measured_sheet(shape);
  sheet.source = test::simulated_sheet(11, 1).source;
  return sheet;
}

TEST(BestTurn, FindsTheTurnOfASheetExactly) {
  for (const double angle : {0.0, 0.3, -2.0, 179.99 * deg, 0.5 * deg}) {
    const auto found = best_turn(test::measured_sheet(turned(folded, angle)),
                                 Surface(as_simulated(folded), "branch"), kAxis);
    ASSERT_TRUE(found);
    EXPECT_FALSE(found->half_turn);
    EXPECT_NEAR(found->turn_rad, angle, 1e-9);
    EXPECT_NEAR(found->mean_m, 0, 1e-9 * mm);
  }
}

TEST(BestTurn, FindsASheetThatLiesTurnedAround) {
  const test::Shape opposite = [](const Eigen::Vector2d& m) {
    return folded(Eigen::Vector2d(kFlatPatch_m, kFlatPatch_m) - m);
  };
  const auto found = best_turn(test::measured_sheet(turned(opposite, 1.1)),
                               Surface(as_simulated(folded), "branch"), kAxis);
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->half_turn);
  EXPECT_NEAR(found->turn_rad, 1.1, 1e-9);
  EXPECT_NEAR(found->mean_m, 0, 1e-9 * mm);
}

TEST(BestTurn, LeavesWhatNoTurnRemoves) {
  // Rings about the axis, raised by 3 mm: every rotation leaves at least this, and one no more.
  const test::Shape raised = [](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    return turned(folded, 0.7)(m) + Eigen::Vector3d(0, 0, 3 * mm);
  };
  const auto found =
      best_turn(test::measured_sheet(raised), Surface(as_simulated(folded), "branch"), kAxis);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->mean_m, 3 * mm, 1e-9 * mm);
}

/// A drape with simulations raised by these heights, each an equilibrium in one list.
DrapeInput with_branches(const std::vector<double>& heights_mm, bool round = false) {
  std::vector<Sheet> sheets;
  for (const double height : heights_mm) {
    const test::Shape raised = [height](const Eigen::Vector2d& m) -> Eigen::Vector3d {
      return test::flat(m) + Eigen::Vector3d(0, 0, height * mm);
    };
    sheets.push_back(test::simulated_sheet(21, 1, raised));
  }
  DrapeInput input = test::drape_of(test::measured_sheet(), sheets);
  for (std::size_t k = 0; k < sheets.size(); ++k) {
    const int number = static_cast<int>(k) + 1;
    input.simulations[k].branch = test::branch("list", number, static_cast<int>(sheets.size()),
                                               1e-3 + 1e-6 * number, 1, round);
  }
  return input;
}

TEST(Branches, TheRealShapeIsAssignedAndBothDistancesAreGiven) {
  const DrapeInput input = with_branches({7, 9, 2, 4});
  const Report report = compare_drape(input, {});
  ASSERT_EQ(report.branch_sets.size(), 1U);
  const BranchSet& set = report.branch_sets.front();
  ASSERT_EQ(set.branches.size(), 4U);
  EXPECT_EQ(set.nearest, 2U);
  EXPECT_EQ(set.runner_up, 3U);
  EXPECT_NEAR(set.branches[0].match_m(), 7 * mm, 1e-12);
  EXPECT_NEAR(set.branches[set.nearest].match_m(), 2 * mm, 1e-12);
  const std::string sentence = branch_sentence(input, set);
  EXPECT_THAT(sentence, HasSubstr("nearest is branch 3 of 4, 2.000 mm"));
  EXPECT_THAT(sentence, HasSubstr("branch 1 of least energy, 2.00 µJ below, 7.000 mm"));
  EXPECT_THAT(sentence, HasSubstr("next nearest branch 4, 4.000 mm"));
  const Table table = branch_table(input, report, set);
  EXPECT_EQ(table.rows[0].back(), "least energy");
  EXPECT_EQ(table.rows[2].back(), "nearest");
  ASSERT_EQ(report.real_virtual.size(), 1U) << "the nearest speaks for them";
  EXPECT_EQ(report.real_virtual.front().simulation, 2U);
  EXPECT_TRUE(report.virtual_virtual.empty()) << "equilibria are no pair of the paper";
}

TEST(Branches, OfSomeOfAListNoneIsCalledTheNearestOrLeastOfAll) {
  DrapeInput input = with_branches({7, 9, 2, 4});
  for (Simulation& one : input.simulations) one.branch->least_j = 1e-3 + 1e-6;
  input.simulations.erase(input.simulations.begin(), input.simulations.begin() + 2);
  const Report report = compare_drape(input, {});
  const BranchSet& set = report.branch_sets.front();
  const std::string sentence = branch_sentence(input, set);
  EXPECT_THAT(sentence, HasSubstr("nearest of those given is branch 3 of 4, 2.000 mm; branch 1 of "
                                  "least energy, 2.00 µJ below, is not given; next nearest "
                                  "branch 4, 4.000 mm"));
  const Table table = branch_table(input, report, set);
  EXPECT_EQ(table.rows[0].back(), "nearest");
  EXPECT_EQ(table.rows[0][2], "2.00") << "above the least of the list";
}

TEST(Branches, NeverTakeThePlaceOfARun) {
  DrapeInput input = with_branches({7, 1});
  const test::Shape raised = [](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    return test::flat(m) + Eigen::Vector3d(0, 0, 5 * mm);
  };
  input.simulations.push_back(
      test::drape_of(test::measured_sheet(), {test::simulated_sheet(21, 1, raised)})
          .simulations.front());
  const Report report = compare_drape(input, {});
  ASSERT_EQ(report.real_virtual.size(), 1U);
  EXPECT_NEAR(report.real_virtual[*report.headline].statistics.mean_m, 5 * mm, 1e-12)
      << "picking the nearest of many shapes afterwards is no prediction";
}

TEST(Branches, ARoundSceneWithoutItsFileAndMissingBranchesAreWarnings) {
  DrapeInput input = with_branches({7, 1, 3}, true);
  input.simulations.pop_back();
  const Report report = compare_drape(input, {});
  EXPECT_THAT(report.warnings, testing::Contains(HasSubstr("scene is round")));
  EXPECT_THAT(report.warnings, testing::Contains(HasSubstr("2 of the 3 that were found")));
}

TEST(Branches, OnARoundObjectATurnedShapeIsTheSameShape) {
  DrapeInput input = test::drape_of(test::measured_sheet(turned(folded, 0.4)),
                                    {as_simulated(test::flat), as_simulated(folded)});
  Scene scene;
  scene.obstacles.emplace_back(Sphere{{kAxis.x(), kAxis.y(), 0}, 45 * mm});
  input.scene = scene;
  for (const int k : {0, 1})
    input.simulations[static_cast<std::size_t>(k)].branch =
        test::branch("list", k + 1, 2, 1e-3, 1, true);
  const Report report = compare_drape(input, {});
  const BranchSet& set = report.branch_sets.front();
  EXPECT_EQ(set.nearest, 1U);
  EXPECT_NEAR(set.branches[1].match_m(), 0, 1e-9 * mm);
  EXPECT_GT(set.branches[1].as_placed.statistics.mean_m, 10 * mm);
  EXPECT_NEAR(set.branches[1].turned->turn_rad, 0.4, 1e-9);
}

/// Writes a run of drape-simulate branches below a measured sheet, as the program does.
std::vector<fs::path> write_branches(const fs::path& folder) {
  const fs::path drape = folder / "A", list = drape / "branches" / "branches.json";
  write_sheet(drape / "sheet.ply", test::measured_sheet(folded));
  BranchList branches;
  for (const int k : {1, 2}) {
    const std::string name = "branch-0" + std::to_string(k) + "/sheet.ply";
    const test::Shape shape = k == 1 ? test::Shape(test::flat) : test::Shape(folded);
    write_sheet(drape / "branches" / name, test::simulated_sheet(31, 1, shape));
    ListedBranch& branch = branches.branches.emplace_back();
    branch.number = k;
    branch.sheet = name;
    branch.energy_j = (7188.835040198145 + k) * 1e-6;
    branch.starts = {0, k};
    branch.hem_nodes = 3 + k;
  }
  write_record(list, branches);
  return {drape};
}

TEST(Branches, AreFoundBelowTheDrapeStoredOnceAndVerified) {
  const drape::test::TemporaryFolder folder;
  const fs::path store = folder.path() / "results.sqlite";
  const auto given = write_branches(folder.path());
  const auto import = [&] {
    const Session session = read_session(files_in(given).sheets, {});
    Outcome outcome;
    compare_session(session, {}, outcome);
    const ImportCounts counts = import_session(store, session, outcome);
    return counts;
  };
  EXPECT_EQ(import().added, 2);
  const std::string before = sha256_of_file(store);
  EXPECT_EQ(import().present, 2);
  EXPECT_EQ(sha256_of_file(store), before);
  {
    const StoreReader reader(store);
    const Table rows = reader.query(
        "SELECT branch, found, round(above_least_uJ, 6), starts, least_energy, nearest FROM "
        "v_branches");
    const std::vector<std::vector<std::string>> expected = {{"1", "2", "0", "2", "1", "0"},
                                                            {"2", "2", "1", "2", "0", "1"}};
    EXPECT_EQ(rows.rows, expected);
    EXPECT_EQ(reader.query("SELECT count(*) FROM v_table1").rows[0][0], "0")
        << "the paper's tables hold no equilibria";
    EXPECT_EQ(paper_tables(reader, {}).back().rows.size(), 2U);
  }
  EXPECT_THAT(verify_store(store).findings, IsEmpty());
  fs::rename(given.front() / "branches", given.front() / "gone");
  EXPECT_THAT(verify_store(store).findings, IsEmpty()) << "its blobs hold the list";
  fs::rename(given.front() / "gone", given.front() / "branches");
}

TEST(Branches, ASheetThatTheListDoesNotNameIsNoBranch) {
  const drape::test::TemporaryFolder folder;
  const auto given = write_branches(folder.path());
  const fs::path stranger = given.front() / "branches" / "other" / "sheet.ply";
  write_sheet(stranger, test::simulated_sheet(11, 1));
  EXPECT_FALSE(branch_of(stranger));
  EXPECT_TRUE(branch_of(given.front() / "branches" / "branch-01" / "sheet.json"));
  write_durable(given.front() / "branches" / "branches.json", "{}");
  EXPECT_THROW(static_cast<void>(branch_of(stranger)), Error);
}

}  // namespace
}  // namespace drape::compare
